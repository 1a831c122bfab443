#ifndef DYNMESH_SERVER_SESSION_CATCH_EXCEPTIONS_H_
#define DYNMESH_SERVER_SESSION_CATCH_EXCEPTIONS_H_

#include <exception>
#include <new>
#include <stdexcept>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/mesh/error.h"
#include "server/session/session_errors.h"

namespace dynmesh {

/// The result of fn(), an absl::Status or StatusOr; exceptions become RESOURCE_EXHAUSTED (memory, sizes
/// beyond what a container holds) or INTERNAL. Where an exception would reach gRPC, this stands.
template <typename Fn>
auto CatchExceptions(Fn&& fn) noexcept -> decltype(fn()) {
  try {
    return fn();
  } catch (const std::bad_alloc&) {
    return OutOfMemory();
  } catch (const std::length_error&) {
    return OutOfMemory();
  } catch (const std::exception& e) {
    return MakeError(absl::StatusCode::kInternal, reason::kInternal,
                     absl::StrCat("unexpected exception: ", e.what()));
  }
}

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_CATCH_EXCEPTIONS_H_
