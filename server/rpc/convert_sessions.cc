#include "server/rpc/convert_sessions.h"

#include <algorithm>
#include <utility>
#include <variant>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "core/mesh/error.h"
#include "server/rpc/convert.h"
#include "server/rpc/convert_checks.h"
#include "server/session/session_errors.h"

namespace dynmesh {
namespace {

// Says which version of a token it is, and keeps a bare name from being one.
constexpr char kTokenPrefix = '1';
// So much of a path that a peer made up is repeated to it.
constexpr size_t kMaxShownPath = 64;

google::protobuf::Timestamp FromTime(absl::Time time) {
  google::protobuf::Timestamp message;
  const int64_t nanos = absl::ToUnixNanos(time);
  message.set_seconds(nanos / 1'000'000'000);
  message.set_nanos(nanos % 1'000'000'000);
  return message;
}

v1::Relation FromRelation(Relation relation) {
  v1::Relation message;
  message.set_from(FromEntityKind(relation.from));
  message.set_to(FromEntityKind(relation.to));
  return message;
}

std::string FromPoint(const Point& point) {
  return std::string(reinterpret_cast<const char*>(point.data()), sizeof(point));
}

absl::Status StageRows(v1::AttributeValues* values, StagedMesh& staged) {
  if (!values->ids().empty()) return BadField("ids", "an import names attribute rows by position, not by id");
  DYNMESH_ASSIGN_OR_RETURN(const AttributeSpec spec, ToAttributeSpec(values->spec()));
  return staged.AddRows(spec, std::move(*values->mutable_values()));
}

/// Fills the part of a message that fits the chunk.
struct ExportVisitor {
  v1::ExportMeshResponse* response;

  void operator()(const ExportedVertices& chunk) const {
    response->mutable_vertices()->set_ids(FromArray(chunk.ids));
    response->mutable_vertices()->set_positions(FromArray(chunk.positions));
  }
  void operator()(const ExportedElements& chunk) const {
    v1::ElementChunk* elements = response->mutable_elements();
    elements->set_ids(FromArray(chunk.ids));
    elements->mutable_block()->set_type(FromElementType(chunk.type));
    elements->mutable_block()->set_vertices(FromArray(chunk.vertices));
  }
  void operator()(const ExportedRows& chunk) const {
    v1::AttributeValues* values = response->mutable_attribute();
    *values->mutable_spec() = FromAttributeSpec(chunk.spec);
    values->set_ids(FromArray(chunk.ids));
    values->set_values(FromArray(chunk.rows));
  }
};

v1::Durability FromDurability(SessionDurability durability) {
  switch (durability) {
    case SessionDurability::kDefault:
      break;
    case SessionDurability::kNone:
      return v1::DURABILITY_NONE;
    case SessionDurability::kAsync:
      return v1::DURABILITY_ASYNC;
    case SessionDurability::kSync:
      return v1::DURABILITY_SYNC;
  }
  return v1::DURABILITY_UNSPECIFIED;
}

v1::SessionState FromState(SessionState state) {
  switch (state) {
    case SessionState::kLoaded:
      return v1::SESSION_STATE_LOADED;
    case SessionState::kStored:
      return v1::SESSION_STATE_STORED;
    case SessionState::kDamaged:
      return v1::SESSION_STATE_DAMAGED;
  }
  return v1::SESSION_STATE_UNSPECIFIED;
}

/// Each storable, and named once.
absl::StatusOr<std::vector<Relation>> ToStoredRelations(const v1::SessionSettings& message) {
  std::vector<Relation> relations;
  for (const v1::Relation& named : message.stored_relations()) {
    Relation relation;
    DYNMESH_ASSIGN_OR_RETURN(relation.from, ToEntityKind(named.from(), "stored_relations"));
    DYNMESH_ASSIGN_OR_RETURN(relation.to, ToEntityKind(named.to(), "stored_relations"));
    const std::string name = absl::StrCat(EntityKindName(relation.from), "->", EntityKindName(relation.to));
    if (StorableIndex(relation) == kNumStorableRelations) {
      return BadField("stored_relations", absl::StrCat(name, " is not one that can be switched"));
    }
    if (std::find(relations.begin(), relations.end(), relation) != relations.end()) {
      return BadField("stored_relations", absl::StrCat(name, " is named twice"));
    }
    relations.push_back(relation);
  }
  return relations;
}

}  // namespace

absl::StatusOr<SessionDurability> ToDurability(v1::Durability durability) {
  switch (durability) {
    case v1::DURABILITY_UNSPECIFIED:
      return SessionDurability::kDefault;
    case v1::DURABILITY_NONE:
      return SessionDurability::kNone;
    case v1::DURABILITY_ASYNC:
      return SessionDurability::kAsync;
    case v1::DURABILITY_SYNC:
      return SessionDurability::kSync;
    default:
      return BadField("durability", "there is no such durability");
  }
}

absl::StatusOr<SessionSettings> ToSettings(const v1::SessionSettings& message) {
  SessionSettings settings;
  if (message.duplicate_policy() == v1::DUPLICATE_POLICY_REFUSE) {
    settings.duplicates = DuplicatePolicy::kRefuse;
  } else if (message.duplicate_policy() != v1::DUPLICATE_POLICY_UNSPECIFIED &&
             message.duplicate_policy() != v1::DUPLICATE_POLICY_KEEP) {
    return BadField("duplicate_policy", "there is no such duplicate_policy");
  }
  DYNMESH_ASSIGN_OR_RETURN(settings.durability, ToDurability(message.durability()));
  DYNMESH_ASSIGN_OR_RETURN(settings.stored_relations, ToStoredRelations(message));
  DYNMESH_ASSIGN_OR_RETURN(settings.checks, ToLocalCheckSettings(message.checks()));
  return settings;
}

absl::StatusOr<SettingsUpdate> ToSettingsUpdate(const v1::UpdateSessionRequest& request) {
  const v1::SessionSettings& settings = request.session().settings();
  if (request.update_mask().paths().empty()) return BadField("update_mask", "update_mask names no field");
  SettingsUpdate update;
  for (const std::string& path : request.update_mask().paths()) {
    if (path == "settings.stored_relations") {
      DYNMESH_ASSIGN_OR_RETURN(update.stored_relations, ToStoredRelations(settings));
    } else if (path == "settings.checks") {
      DYNMESH_ASSIGN_OR_RETURN(update.checks, ToLocalCheckSettings(settings.checks()));
    } else {
      return BadField("update_mask", absl::StrCat("\"", absl::CHexEscape(path.substr(0, kMaxShownPath)),
                                                  "\" is not a field that can be changed"));
    }
  }
  return update;
}

v1::Session FromSessionInfo(const SessionInfo& info) {
  v1::Session message;
  message.set_name(info.name);
  message.set_uid(info.uid);
  message.set_revision(info.revision);
  message.set_durable_revision(info.durable_revision);
  message.set_state(FromState(info.state));
  message.set_state_message(info.state_message);
  message.set_etag(info.etag);
  message.mutable_settings()->set_durability(FromDurability(info.settings.durability));
  message.mutable_settings()->set_duplicate_policy(info.settings.duplicates == DuplicatePolicy::kRefuse
                                                       ? v1::DUPLICATE_POLICY_REFUSE
                                                       : v1::DUPLICATE_POLICY_KEEP);
  for (const StoredRelation& stored : info.stored_relations) {
    *message.mutable_settings()->add_stored_relations() = FromRelation(stored.relation);
    v1::StoredRelation* part = message.add_stored_relations();
    *part->mutable_relation() = FromRelation(stored.relation);
    part->set_memory_bytes(stored.memory_bytes);
  }
  FromCheckSettings(info.settings.checks, message.mutable_settings()->mutable_checks());
  *message.mutable_create_time() = FromTime(info.create_time);
  *message.mutable_update_time() = FromTime(info.update_time);
  *message.mutable_counts() = FromCounts(info.counts);
  *message.mutable_estimated_counts() = FromCounts(info.estimated_counts);
  *message.mutable_boundary_counts() = FromCounts(info.boundary_counts);
  *message.mutable_element_counts() = FromCounts(info.element_counts);
  message.set_euler_characteristic(info.euler_characteristic);
  *message.mutable_checksum() = FromChecksum(info.checksum);
  message.set_memory_bytes(info.memory_bytes);
  message.set_index_bytes(info.index_bytes);
  message.set_undoable_batches(info.undoable_batches);
  message.set_redoable_batches(info.redoable_batches);
  message.set_history_bytes(info.history_bytes);
  message.set_followers(info.followers);
  for (const AttributeSpec& spec : info.attributes) *message.add_attributes() = FromAttributeSpec(spec);
  if (info.bounds.has_value()) {
    message.set_bounds_low(FromPoint(info.bounds->low));
    message.set_bounds_high(FromPoint(info.bounds->high));
  }
  return message;
}

std::string ToPageToken(absl::string_view last_name) {
  return absl::WebSafeBase64Escape(absl::StrCat(absl::string_view(&kTokenPrefix, 1), last_name));
}

absl::StatusOr<std::string> FromPageToken(const std::string& token) {
  if (token.empty()) return std::string();
  std::string name;
  const bool decoded = absl::WebSafeBase64Unescape(token, &name);
  if (decoded && !name.empty() && name[0] == kTokenPrefix && CheckSessionName(name.substr(1)).ok()) {
    return name.substr(1);
  }
  return InvalidArgument(reason::kBadPageToken, "page_token is none that this server gave",
                         {{"field", "page_token"}});
}

absl::StatusOr<ImportOptions> ToImportOptions(const v1::ImportHeader& header) {
  ImportOptions options;
  if (header.slot_order() == v1::SLOT_ORDER_HILBERT) {
    options.slot_order = SlotOrder::kHilbert;
  } else if (header.slot_order() != v1::SLOT_ORDER_UNSPECIFIED &&
             header.slot_order() != v1::SLOT_ORDER_CALLER) {
    return BadField("slot_order", "there is no such slot_order");
  }
  options.num_vertices = header.num_vertices();
  options.num_elements = header.num_elements();
  options.validate_only = header.validate_only();
  options.request_id = header.request_id();
  return options;
}

absl::Status StagePart(v1::ImportMeshRequest* request, StagedMesh& staged) {
  switch (request->part_case()) {
    case v1::ImportMeshRequest::kPositions:
      return staged.AddPositions(std::move(*request->mutable_positions()));
    case v1::ImportMeshRequest::kElements: {
      v1::ElementBlock* block = request->mutable_elements();
      return staged.AddElements(static_cast<ElementType>(IsElementType(block->type()) ? block->type() : 0),
                                std::move(*block->mutable_vertices()));
    }
    case v1::ImportMeshRequest::kAttribute:
      return StageRows(request->mutable_attribute(), staged);
    case v1::ImportMeshRequest::kHeader:
      return BadField("header", "only the first message of an import is a header");
    case v1::ImportMeshRequest::PART_NOT_SET:
      break;
  }
  return BadField("part", "a message of an import is empty, or of a kind that this server does not know");
}

void FromImportOutcome(const ImportOutcome& outcome, v1::ImportResult* result) {
  result->set_revision(outcome.revision);
  *result->mutable_session() = FromSessionInfo(outcome.info);
  for (const MeshWarning& warning : outcome.warnings) *result->add_warnings() = FromWarning(warning);
}

void FromExportChunk(const ExportChunk& chunk, v1::ExportMeshResponse* response) {
  std::visit(ExportVisitor{response}, chunk);
}

}  // namespace dynmesh
