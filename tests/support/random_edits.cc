#include "tests/support/random_edits.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace dynmesh::testing {

RandomEditor::RandomEditor(Mesh& mesh, ElementModel& model, uint32_t seed, RandomEditOptions options)
    : mesh_(mesh), model_(model), rng_(seed), options_(std::move(options)) {}

void RandomEditor::Edit() {
  const int roll = Uniform(100);
  if (model_.vertices.size() < 4 || roll < 12) return AddVertex();
  if (roll < 17) return RemoveVertex();
  if (roll < 22) return MoveVertex();
  if (roll < 26 && options_.attributes) return SetAttribute();
  if (roll < 65) return AddElement();
  if (roll < 65 + 100 * options_.duplicate_rate && !model_.elements.empty()) return AddDuplicate();
  RemoveElement();
}

void RandomEditor::AddVertex() {
  if (static_cast<int>(model_.vertices.size()) >= options_.max_vertices) return RemoveElement();
  const Point position = AnyPoint();
  const auto v = mesh_.AddVertex(position);
  ASSERT_TRUE(v.ok()) << v.status();
  model_.vertices[*v] = position;
}

void RandomEditor::RemoveVertex() {
  const VertexId v = AnyVertex();
  const bool used = std::any_of(model_.elements.begin(), model_.elements.end(), [&](const auto& entry) {
    const auto& vertices = entry.second.vertices;
    return std::find(vertices.begin(), vertices.end(), v) != vertices.end();
  });
  const absl::Status status = mesh_.RemoveVertex(v);
  EXPECT_EQ(ErrorReason(status), used ? reason::kVertexInUse : "");
  if (!used) model_.vertices.erase(v);
}

void RandomEditor::MoveVertex() {
  const VertexId v = AnyVertex();
  const Point position = AnyPoint();
  EXPECT_TRUE(mesh_.MoveVertex(v, position).ok());
  model_.vertices[v] = position;
}

void RandomEditor::AddElement() {
  const ElementType type = options_.types[Uniform(options_.types.size())];
  std::vector<VertexId> all;
  for (const auto& [v, position] : model_.vertices) all.push_back(v);
  std::shuffle(all.begin(), all.end(), rng_);
  const bool degenerate = std::uniform_real_distribution<>()(rng_) < options_.degenerate_rate;
  std::vector<VertexId> vertices;
  for (int k = 0; k < NumVertices(type); ++k) vertices.push_back(degenerate ? AnyVertex() : all[k % all.size()]);
  Put(type, vertices);
}

void RandomEditor::AddDuplicate() {
  const auto& [id, element] = *std::next(model_.elements.begin(), Uniform(model_.elements.size()));
  std::vector<VertexId> vertices = element.vertices;
  if (id.kind == EntityKind::kFace) {
    std::rotate(vertices.begin(), vertices.begin() + Uniform(vertices.size()), vertices.end());
  }
  if (id.kind != EntityKind::kCell && Uniform(2) == 0) std::reverse(vertices.begin(), vertices.end());
  Put(ElementType(element.type), vertices);
}

void RandomEditor::Put(ElementType type, const std::vector<VertexId>& vertices) {
  const auto id = mesh_.AddElement(type, vertices);
  ASSERT_TRUE(id.ok()) << id.status();
  EXPECT_TRUE(model_.elements.emplace(*id, ElementModel::Element{type, vertices}).second) << "slot given out twice";
}

void RandomEditor::RemoveElement() {
  if (model_.elements.empty()) return AddElement();
  const auto it = std::next(model_.elements.begin(), Uniform(model_.elements.size()));
  const absl::Status status = mesh_.RemoveElement(it->first);
  EXPECT_TRUE(status.ok()) << status;
  model_.elements.erase(it);
}

void RandomEditor::SetAttribute() {
  if (mesh_.attributes().empty() || Uniform(20) == 0) {
    AttributeSpec spec;
    spec.name = "a" + std::to_string(mesh_.attributes().size());
    spec.kind = kEntityKinds[Uniform(kNumEntityKinds)];
    spec.type = static_cast<AttributeType>(1 + Uniform(5));
    spec.components = 1 + Uniform(3);
    spec.policy = static_cast<AttributePolicy>(Uniform(5));
    if (Uniform(2) == 0) spec.default_row = AnyRow(spec);
    EXPECT_TRUE(mesh_.AddAttribute(spec).ok());
  }
  const int column = Uniform(mesh_.attributes().size());
  const AttributeSpec& spec = mesh_.attributes()[column].spec();
  const Slot slot = mesh_.slots(spec.kind).live().Next(Uniform(20));
  if (slot == kNoSlot) return;
  EXPECT_TRUE(mesh_.SetAttribute(column, slot, AnyRow(spec)).ok());
}

/// Bytes whose floating-point numbers are finite: no exponent has all bits.
std::vector<uint8_t> RandomEditor::AnyRow(const AttributeSpec& spec) {
  std::vector<uint8_t> row(spec.row_bytes());
  for (uint8_t& byte : row) byte = Uniform(IsFloatingPoint(spec.type) ? 0x7f : 256);
  return row;
}

VertexId RandomEditor::AnyVertex() { return std::next(model_.vertices.begin(), Uniform(model_.vertices.size()))->first; }

Point RandomEditor::AnyPoint() {
  std::uniform_real_distribution<> uniform(-1, 1);
  return {uniform(rng_), uniform(rng_), uniform(rng_)};
}

}  // namespace dynmesh::testing
