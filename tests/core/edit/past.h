#ifndef DYNMESH_TESTS_CORE_EDIT_PAST_H_
#define DYNMESH_TESTS_CORE_EDIT_PAST_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/delta/mirror.h"
#include "core/edit/batch_keeper.h"
#include "core/mesh/mesh.h"
#include "tests/core/archive/archive_support.h"

namespace dynmesh::testing {

/// Takes the record of each batch.
class RecordKeeper : public BatchKeeper {
 public:
  explicit RecordKeeper(ArchiveKeeper& records) : records_(records) {}
  absl::Status Keep(const Mesh& mesh) override {
    records_.Keep(mesh);
    return absl::OkStatus();
  }

 private:
  ArchiveKeeper& records_;
};

/// Fails the test unless the mesh is sound and holds what `then` held: all but stamps, with the default in
/// columns that `then` has not.
void ExpectSameContent(const Mesh& mesh, const Mesh& then);

/// Fails the test unless deltas since `before` tell nothing but what is another entity or has changed, and
/// all entities that live in both with other births were born at the mesh's revision.
void ExpectStampsOfDifference(const Mesh& mesh, const Mesh& before);

/// A mesh with a copy of all that it ever was, followed by an archive and by mirrors of every age.
class Past {
 public:
  explicit Past(Mesh mesh) : mesh_(std::move(mesh)), records_(mesh_), keeper_(records_) { Note(); }

  Mesh& mesh() { return mesh_; }
  BatchKeeper& keeper() { return keeper_; }
  /// How many states there were, the present one last.
  size_t size() const { return pages_.size(); }
  const Mesh& then(size_t i) const { return pages_[i].mesh; }

  /// To be called after each batch.
  void Note();
  /// Goes back to a state that was, in vain first; undoes and redoes it. All of it is checked.
  void GoBackTo(size_t i);

 private:
  struct Page {
    Mesh mesh;
    Mirror mirror;
  };

  void Restore(const Mesh& target, const Mesh& then);
  void RestoreInVain(const Mesh& target);
  void RestoreImage(const BatchImage& image, const Mesh& then, BatchImage& inverse);
  /// After a batch that made of `before` what equals `then`.
  void Check(const Mesh& before, const Mesh& then);
  void CheckMirrors();

  Mesh mesh_;
  ArchiveKeeper records_;
  RecordKeeper keeper_;
  std::vector<Page> pages_;
  int num_checks_ = 0;
};

}  // namespace dynmesh::testing

#endif  // DYNMESH_TESTS_CORE_EDIT_PAST_H_
