#ifndef DYNMESH_TESTS_CORE_CODEC_DELTA_SAMPLES_H_
#define DYNMESH_TESTS_CORE_CODEC_DELTA_SAMPLES_H_

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "core/codec/codec.h"
#include "core/delta/delta.h"

/// Deltas to encode, and how to compare what comes back.
namespace dynmesh {

using Rng = std::mt19937_64;

inline constexpr Codec kAllCodecs[] = {Codec::kUnspecified, Codec::kRaw, Codec::kZstd, Codec::kDraco};

/// For names of tests: "Auto", "Raw", "Zstd", "Draco".
std::string CodecName(Codec codec);

struct NamedDelta {
  std::string name;
  Delta delta;
};

/// One small delta for each thing that a delta can be: empty, one element, removals only, every element
/// type, repeated vertices, the largest slots, dangling faces and wire edges, attributes of both types, ...
std::vector<NamedDelta> SmallDeltas();

/// A valid delta of about `size` entries in each of its lists, with whatever `rng` comes up with.
Delta RandomDelta(Rng& rng, int size);

/// A block of n * n * n cubes as hexahedra (or six tetrahedra each), slots in order.
Delta HexBlock(int n);
Delta TetBlock(int n);

/// Whether two deltas are equal to the bit: 0.0 and -0.0 differ.
bool SameBits(const Delta& a, const Delta& b);

}  // namespace dynmesh

#endif  // DYNMESH_TESTS_CORE_CODEC_DELTA_SAMPLES_H_
