#ifndef DYNMESH_TESTS_CORE_CODEC_ALLOCATION_METER_H_
#define DYNMESH_TESTS_CORE_CODEC_ALLOCATION_METER_H_

#include <cstddef>

/// Counts what passes through operator new, in this program and in the libraries that it loads.
namespace dynmesh {

/// The largest number of bytes that lived at once since construction, beyond those that lived before.
/// Thread safety: one at a time, in a program of one thread.
class AllocationMeter {
 public:
  AllocationMeter();
  size_t peak_bytes() const;

 private:
  size_t before_;
};

}  // namespace dynmesh

#endif  // DYNMESH_TESTS_CORE_CODEC_ALLOCATION_METER_H_
