#include "server/session/fingerprint.h"

#include <bit>
#include <variant>

#include "xxhash.h"

namespace dynmesh {
namespace {

/// Adds the fields of each kind of edit.
struct EditVisitor {
  Fingerprint& fingerprint;

  void operator()(const AddVerticesEdit& edit) { fingerprint.AddArray(edit.positions); }
  void operator()(const RemoveVerticesEdit& edit) { fingerprint.AddArray(edit.vertices); }
  void operator()(const MoveVerticesEdit& edit) {
    fingerprint.AddArray(edit.vertices);
    fingerprint.AddArray(edit.positions);
  }
  void operator()(const AddElementsEdit& edit) {
    fingerprint.AddNumber(static_cast<uint64_t>(edit.type));
    fingerprint.AddArray(edit.vertices);
  }
  void operator()(const RemoveElementsEdit& edit) {
    fingerprint.AddNumber(Dimension(edit.kind));
    fingerprint.AddArray(edit.elements);
  }
  void operator()(const AddAttributeEdit& edit) { fingerprint.AddSpec(edit.spec); }
  void operator()(const SetAttributeEdit& edit) {
    fingerprint.AddSpec(edit.spec);
    fingerprint.AddArray(edit.slots);
    fingerprint.AddArray(edit.rows);
  }
  void operator()(const SplitEdgesEdit& edit) { AddPlaced(edit); }
  void operator()(const CollapseEdgesEdit& edit) { AddPlaced(edit); }
  void operator()(const SwapEdgesEdit& edit) {
    Add(edit.edges);
    Add(edit.limits);
  }
  void operator()(const SwapFacesEdit& edit) {
    fingerprint.AddArray(edit.faces);
    Add(edit.limits);
  }
  void operator()(const SplitElementsEdit& edit) {
    fingerprint.AddNumber(Dimension(edit.kind));
    fingerprint.AddArray(edit.elements);
    fingerprint.AddArray(edit.positions);
    Add(edit.limits);
  }
  void operator()(const MergeVerticesEdit& edit) {
    fingerprint.AddArray(edit.pairs);
    fingerprint.AddArray(edit.positions);
    Add(edit.limits);
  }
  void operator()(const DissolveVerticesEdit& edit) {
    fingerprint.AddArray(edit.vertices);
    Add(edit.limits);
  }

  void operator()(const SmoothVerticesEdit& edit) {
    fingerprint.AddArray(edit.vertices);
    fingerprint.AddNumber(static_cast<uint64_t>(edit.rule.method));
    fingerprint.AddNumber(std::bit_cast<uint64_t>(edit.rule.factor));
    fingerprint.AddNumber(edit.rule.move_boundary);
    fingerprint.AddNumber(edit.rule.tangential);
    fingerprint.AddNumber(edit.iterations);
    Add(edit.limits);
  }

  template <typename EdgesEdit>
  void AddPlaced(const EdgesEdit& edit) {
    Add(edit.edges);
    fingerprint.AddArray(edit.parameters);
    fingerprint.AddArray(edit.positions);
    Add(edit.limits);
  }
  void Add(const EdgeNames& edges) {
    fingerprint.AddArray(edges.ids);
    fingerprint.AddArray(edges.ends);
  }
  void Add(const PatchLimits& limits) {
    fingerprint.AddNumber(limits.keep_orientation);
    fingerprint.AddNumber(std::bit_cast<uint64_t>(limits.min_quality));
  }
};

}  // namespace

Fingerprint::Fingerprint()
    : state_(XXH64_createState(), [](XXH64_state_s* state) { XXH64_freeState(state); }) {
  XXH64_reset(state_.get(), 0);
}

Fingerprint::~Fingerprint() = default;

void Fingerprint::AddBytes(const void* data, size_t size) { XXH64_update(state_.get(), data, size); }

void Fingerprint::AddString(absl::string_view text) {
  AddNumber(text.size());
  AddBytes(text.data(), text.size());
}

void Fingerprint::AddSpec(const AttributeSpec& spec) {
  AddString(spec.name);
  AddNumber(Dimension(spec.kind));
  AddNumber(static_cast<uint64_t>(spec.type));
  AddNumber(spec.components);
  AddNumber(static_cast<uint64_t>(spec.effective_policy()));
  AddArray(spec.default_row);
}

void Fingerprint::AddEdit(const Edit& edit) {
  AddNumber(edit.index());
  std::visit(EditVisitor{*this}, edit);
}

uint64_t Fingerprint::value() const { return XXH64_digest(state_.get()); }

}  // namespace dynmesh
