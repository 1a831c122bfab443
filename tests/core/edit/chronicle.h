#ifndef DYNMESH_TESTS_CORE_EDIT_CHRONICLE_H_
#define DYNMESH_TESTS_CORE_EDIT_CHRONICLE_H_

#include <cstdint>
#include <string>
#include <vector>

#include "core/delta/mirror.h"
#include "core/edit/transaction.h"
#include "core/mesh/batch_image.h"
#include "core/mesh/mesh.h"
#include "tests/support/oracle.h"

namespace dynmesh::testing {

/// The first line that differs, as it is and as it should be; empty without one.
std::string FirstDifference(const std::string& actual, const std::string& expected);

/// A mesh with what it held after each batch so far, and the images that lead to and fro. Every move is
/// checked against the page that was noted then, and followed by a mirror.
class Chronicle {
 public:
  explicit Chronicle(Mesh mesh) : mesh_(std::move(mesh)) { Note(); }

  Mesh& mesh() { return mesh_; }
  const ElementModel& model() const { return pages_[undos_.size()].model; }
  size_t num_undos() const { return undos_.size(); }
  size_t num_redos() const { return redos_.size(); }

  /// Notes a batch that was committed.
  void Add(BatchImage image);
  /// Applies edits as one batch and notes it.
  void Do(const std::vector<Edit>& edits);

  /// Undoes, or redoes, the last `count` batches as one revision.
  void Undo(size_t count) { Move(count, undos_, redos_); }
  void Redo(size_t count) { Move(count, redos_, undos_); }

  /// Fails the test unless undoing can be rolled back without a trace.
  void UndoInVain(size_t count);
  /// There and back in all of these ways; all is undone in the end.
  void UndoAndRedoAll();

 private:
  struct Page {
    std::string content;
    size_t num_columns;
    ElementModel model;
  };

  static std::vector<const BatchImage*> Last(size_t count, const std::vector<BatchImage>& images);
  void Move(size_t count, std::vector<BatchImage>& from, std::vector<BatchImage>& to);
  void Note();
  void Check();
  void ExpectSameRows();

  Mesh mesh_;
  Mirror mirror_;
  std::vector<Page> pages_;  ///< pages_[n]: after n batches
  std::vector<BatchImage> undos_, redos_;
  int num_checks_ = 0;
};

}  // namespace dynmesh::testing

#endif  // DYNMESH_TESTS_CORE_EDIT_CHRONICLE_H_
