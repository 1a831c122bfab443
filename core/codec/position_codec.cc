#include "core/codec/position_codec.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "core/codec/bytes.h"
#include "core/codec/planes.h"
#include "core/codec/symbols.h"
#include "core/mesh/error.h"

namespace dynmesh {
namespace {

constexpr RowShape kPointShape{AttributeType::kFloat64, 3};

uint32_t LastIndex(const QuantizationGrid& grid) { return (1u << grid.bits) - 1; }

// Differences may overflow to infinity in a grid over the whole range of doubles; clamping takes that in.
uint32_t GridIndex(double coordinate, int axis, const QuantizationGrid& grid) {
  const double index = std::round((coordinate - grid.origin[axis]) / grid.step);
  return static_cast<uint32_t>(std::clamp<double>(index, 0, LastIndex(grid)));
}

// One axis as zigzag differences of grid indices from vertex to vertex.
std::vector<uint32_t> AxisSymbols(const std::vector<Point>& positions, int axis,
                                  const QuantizationGrid& grid) {
  std::vector<uint32_t> symbols(positions.size());
  uint32_t last = 0;
  for (size_t i = 0; i < positions.size(); ++i) {
    const uint32_t index = GridIndex(positions[i][axis], axis, grid);
    symbols[i] = ZigZag(index - std::exchange(last, index));
  }
  return symbols;
}

absl::Status DecodeAxis(int axis, const QuantizationGrid& grid, SectionReader& sections,
                        std::vector<Point>& positions) {
  DYNMESH_ASSIGN_OR_RETURN(const std::vector<uint32_t> symbols,
                           UnpackSymbols(sections.Take(section::kGridIndices[axis])));
  if (symbols.size() != positions.size()) return CorruptPayload("positions are not one for each vertex");
  uint32_t index = 0;
  for (size_t i = 0; i < positions.size(); ++i) {
    index += UnZigZag(symbols[i]);
    if (index > LastIndex(grid)) return CorruptPayload("a position lies outside the message's grid");
    positions[i][axis] = grid.origin[axis] + index * grid.step;
  }
  return absl::OkStatus();
}

absl::StatusOr<std::vector<Point>> DecodeLossless(size_t count, const Section& section) {
  if (section.count != count * sizeof(Point)) return CorruptPayload("positions are not one for each vertex");
  std::vector<Point> positions(count);
  if (count == 0) return positions;
  DYNMESH_ASSIGN_OR_RETURN(const std::vector<uint8_t> rows, UnpackRows(section, kPointShape));
  std::memcpy(positions.data(), rows.data(), rows.size());
  return positions;
}

}  // namespace

QuantizationGrid MakeGrid(const Point& low, const Point& high, int bits) {
  QuantizationGrid grid{low, 0, bits};
  const double last = LastIndex(grid);
  for (int axis = 0; axis < 3; ++axis) grid.step = std::max(grid.step, (high[axis] - low[axis]) / last);
  if (!(grid.step > 0)) grid.step = 1;
  return grid;
}

void EncodePositions(const std::vector<Point>& positions, const EncodeOptions& options,
                     MessageWriter& writer) {
  if (options.grid.step > 0) {
    for (int axis = 0; axis < 3; ++axis) {
      const std::vector<uint32_t> symbols = AxisSymbols(positions, axis, options.grid);
      writer.Add(section::kGridIndices[axis], PackSymbols(symbols, options.codec));
    }
    return;
  }
  const auto* bytes = reinterpret_cast<const uint8_t*>(positions.data());
  writer.Add(section::kPositions,
             PackRows({bytes, positions.size() * sizeof(Point)}, kPointShape, options.codec));
}

absl::StatusOr<std::vector<Point>> DecodePositions(size_t count, const QuantizationGrid& grid,
                                                   SectionReader& sections) {
  if (grid.bits == 0) return DecodeLossless(count, sections.Take(section::kPositions));
  std::vector<Point> positions(count);
  for (int axis = 0; axis < 3; ++axis) {
    DYNMESH_RETURN_IF_ERROR(DecodeAxis(axis, grid, sections, positions));
  }
  return positions;
}

}  // namespace dynmesh
