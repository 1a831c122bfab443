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

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_HEAP_H_
