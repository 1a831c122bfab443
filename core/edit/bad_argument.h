#ifndef DYNMESH_CORE_EDIT_BAD_ARGUMENT_H_
#define DYNMESH_CORE_EDIT_BAD_ARGUMENT_H_

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "core/mesh/error.h"
#include "core/mesh/ids.h"

namespace dynmesh {

/// INVALID_ARGUMENT BAD_ARRAY_LENGTH.
inline absl::Status BadLength(absl::string_view what, size_t expected, size_t actual) {
  return InvalidArgument(reason::kBadArrayLength,
                         absl::StrCat(what, ": expected ", expected, " entries, got ", actual));
}

/// INVALID_ARGUMENT BAD_ENTITY_KIND.
inline absl::Status BadKind(EntityKind kind) {
  return InvalidArgument(reason::kBadEntityKind,
                         absl::StrCat("entity kind ", Dimension(kind), " is none of 0-3"));
}

}  // namespace dynmesh

#endif  // DYNMESH_CORE_EDIT_BAD_ARGUMENT_H_
