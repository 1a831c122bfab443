#ifndef DYNMESH_SERVER_SESSION_HEAP_H_
#define DYNMESH_SERVER_SESSION_HEAP_H_

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace dynmesh {

/// Gives freed memory back to the system, so that what is gone does not count against a daemon for ever.
/// Cost: up to some hundred milliseconds, in which others may wait for memory.
inline void TrimHeap() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

/// Makes blocks of a megabyte and more go back to the system as soon as they are freed, and limits what else
/// a thread keeps to about as much. By itself glibc raises both bounds, to 32 and 64 MiB, when such blocks
/// are freed, and TrimHeap() does not reach what threads keep at the ends of their heaps: with some threads
/// that is as much as large sessions hold. For the program, before it starts threads.
inline void ReturnLargeBlocks() {
#ifdef __GLIBC__
  constexpr int kLargeBytes = 1 << 20;
  mallopt(M_MMAP_THRESHOLD, kLargeBytes);
  mallopt(M_TRIM_THRESHOLD, kLargeBytes);
#endif
}

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_HEAP_H_
