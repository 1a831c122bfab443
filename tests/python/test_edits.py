"""Batches of edits: all or nothing, handles, retries, dry runs and streams."""

import dynmesh
import numpy as np
import pytest
from dynmesh import EditBatch
from shapes import TET, two_tets


def tet_batch(shift: float = 0.0) -> EditBatch:
    """Four new vertices and a tetrahedron of them."""
    batch = EditBatch()
    handles = batch.add_vertices(TET + shift)
    batch.add_elements("tetra", [handles])
    return batch


def test_a_block_is_one_revision_and_handles_become_ids(session):
    with session.edit() as tx:
        first = tx.add_vertices(TET)
        second = tx.add_vertices([[1, 1, 1]])
        tets = tx.add_elements("tetra", [first, np.append(first[1:], second)])
        lines = tx.add_elements("line", [[first[0], second[0]]])
    result = tx.result
    assert (result.revision, session.revision) == (1, 1)
    assert session.positions(result.resolve(second)).tolist() == [[1, 1, 1]]
    cells = session.entities("cell", result.new_ids[tets])
    assert cells.vertices.tolist() == [
        *result.resolve(first),
        *result.resolve(first[1:]),
        *result.resolve(second),
    ]
    assert session.entities("edge", result.new_ids[lines]).is_element.all()
    assert result.checksum == session.info().checksum and result.counts == session.counts


def test_ids_beside_handles_stay_as_they_are(session):
    session.import_mesh(TET, {})
    with session.edit() as tx:
        new = tx.add_vertices([[2, 2, 2]])
        tx.add_elements("triangle", [[0, 1, new[0]]])
    assert tx.result.resolve([[0, 1, new[0]]]).tolist() == [[0, 1, 4]]


def test_a_handle_of_another_batch_is_refused(session):
    with session.edit() as tx:
        old = tx.add_vertices(TET)
        tx.add_elements("tetra", [old])
    for use in (
        lambda batch: batch.add_elements("tetra", [old]),
        lambda batch: batch.add_elements("line", [[0, old[3]]]),
        lambda batch: batch.move_vertices(old[:1], [[0, 0, 0]]),
        lambda batch: batch.remove_vertices(old),
        lambda batch: batch.set_attribute("t", "vertex", old[:1], [1.0]),
    ):
        batch = EditBatch()
        batch.add_vertices(TET)
        with pytest.raises(dynmesh.InvalidArgumentError, match="FOREIGN_HANDLE"):
            use(batch)
    with session.edit() as other:
        other.add_vertices(TET)
    with pytest.raises(dynmesh.InvalidArgumentError, match="FOREIGN_HANDLE") as caught:
        other.result.resolve([[1, 2], [3, old[0]]])
    assert caught.value.metadata == {"index": "3"}
    with pytest.raises(dynmesh.InvalidArgumentError):
        session.positions(old)
    assert tx.result.resolve(old).tolist() == [0, 1, 2, 3]


def test_an_exception_in_the_block_sends_nothing(session):
    with pytest.raises(ZeroDivisionError):
        with session.edit() as tx:
            tx.add_vertices(TET)
            1 / 0
    assert session.revision == 0
    with pytest.raises(RuntimeError, match="not been committed"):
        tx.result


def test_a_refused_batch_changes_nothing_and_names_the_edit(session):
    session.import_mesh(two_tets())
    before = session.info()
    with pytest.raises(dynmesh.FailedPreconditionError) as caught:
        with session.edit() as tx:
            tx.move_vertices([0], [[9, 9, 9]])
            tx.remove_elements("cell", [0])
            tx.remove_vertices([0, 4])
    assert caught.value.metadata["edit"] == "2" and caught.value.metadata["index"] == "1"
    after = session.info()
    assert (after.revision, after.checksum, after.counts) == (before.revision, before.checksum, before.counts)


def test_a_derived_face_is_not_an_element(session):
    session.import_mesh(two_tets())
    with pytest.raises(dynmesh.FailedPreconditionError, match="NOT_AN_ELEMENT"):
        with session.edit() as tx:
            tx.remove_elements("face", [0])


def test_removing_a_cell_takes_what_only_it_needed(session):
    session.import_mesh(two_tets())
    with session.edit() as tx:
        tx.remove_elements("cell", [1])
        tx.remove_vertices([4])
    assert session.counts == (4, 6, 4, 1)


def test_a_dry_run_says_what_would_be(session):
    session.import_mesh(two_tets())
    with session.edit(validate_only=True) as dry:
        dry.add_elements("line", [[0, 4]])
    assert dry.result.revision == 1 and dry.result.counts.edges == 10
    assert session.counts.edges == 9
    with session.edit() as real:
        real.add_elements("line", [[0, 4]])
    assert [ids.tolist() for ids in real.result.new_ids] == [ids.tolist() for ids in dry.result.new_ids]
    assert real.result.checksum == dry.result.checksum


def test_a_batch_beyond_the_limit_is_refused_by_the_name_of_the_limit(session):
    with pytest.raises(dynmesh.ResourceExhaustedError) as caught:
        with session.edit() as tx:
            tx.add_vertices(np.zeros((200_000, 3)))
    assert caught.value.reason == "LIMIT_EXCEEDED" and caught.value.metadata["limit"] == "max_message_bytes"
    assert session.revision == 0


def test_what_grpc_would_refuse_is_not_sent(daemon, session):
    batch = EditBatch()
    batch.add_vertices(np.zeros((750_000, 3)))  # 18 MB; up to 16 MiB the server says it by itself

    def check(call):
        with pytest.raises(dynmesh.ResourceExhaustedError, match="LIMIT_EXCEEDED") as caught:
            call()
        assert caught.value.metadata["limit"] == "max_message_bytes"
        assert int(caught.value.metadata["requested"]) > 18_000_000

    check(lambda: session.apply(batch))
    with session.edit_stream() as stream:
        good = stream.submit(tet_batch())
        check(lambda: stream.submit(batch))
        assert stream.submit(tet_batch(1.0)).result().revision == 2  # the stream goes on
    assert good.result().revision == 1
    with daemon.connect(max_message_bytes=1000) as client:
        with pytest.raises(dynmesh.ResourceExhaustedError, match="max_message_bytes"):
            client.session(session.name).import_mesh(np.zeros((400, 3)), {})
    assert session.revision == 2


def test_if_revision_refuses_when_somebody_was_faster(session):
    session.import_mesh(TET, {})
    with session.edit(if_revision=1) as tx:
        tx.move_vertices([0], [[0, 0, 1]])
    with pytest.raises(dynmesh.AbortedError, match="REVISION_MISMATCH"):
        with session.edit(if_revision=1) as tx:
            tx.move_vertices([0], [[0, 0, 2]])
    assert session.positions([0]).tolist() == [[0, 0, 1]]


def test_the_same_request_twice_is_one_edit(session):
    first = session.apply(tet_batch(), request_id="once")
    again = session.apply(tet_batch(), request_id="once")
    assert session.revision == 1 and again.revision == first.revision
    assert [ids.tolist() for ids in again.new_ids] == [ids.tolist() for ids in first.new_ids]
    with pytest.raises(dynmesh.InvalidArgumentError, match="REQUEST_ID_REUSED"):
        session.apply(tet_batch(1.0), request_id="once")


def test_a_batch_without_edits_answers_with_the_revision(session):
    session.import_mesh(TET, {})
    with session.edit() as tx:
        pass
    assert tx.result.revision == 1 and session.revision == 1


def test_edits_warn_of_degenerate_elements(session):
    session.import_mesh(TET, {})
    with session.edit() as tx:
        index = tx.add_elements("triangle", [[0, 1, 1]])
    (warning,) = tx.result.warnings
    assert (warning.reason, warning.kind, warning.count) == ("DEGENERATE_ELEMENT", dynmesh.EntityKind.FACE, 1)
    assert warning.ids.tolist() == tx.result.new_ids[index].tolist()


def test_a_stream_answers_in_order_and_survives_refusals(session):
    bad = EditBatch()
    bad.remove_vertices([10**6])
    with session.edit_stream(window=4) as stream:
        futures = [stream.submit(bad if i == 7 else tet_batch(i)) for i in range(20)]
    with pytest.raises(dynmesh.NotFoundError) as caught:
        futures.pop(7).result()
    assert caught.value.reason == "UNKNOWN_ENTITY"
    assert [future.result(20).revision for future in futures] == list(range(1, 20))
    assert session.counts.cells == 19


def test_a_stream_to_nobody_fails_every_batch():
    with dynmesh.connect("unix:/nonexistent/dynmesh") as client:
        with client.session("a").edit_stream(window=2) as stream:
            with pytest.raises(dynmesh.UnavailableError):
                for _ in range(5):
                    stream.submit(tet_batch()).result(20)


def test_a_finished_batch_takes_no_more(session):
    with session.edit() as tx:
        tx.add_vertices([[0, 0, 0]])
    with pytest.raises(RuntimeError, match="has ended"):
        tx.move_vertices([0], [[1, 1, 1]])
    with pytest.raises(RuntimeError, match="has ended"), tx:
        pass
    assert session.info().revision == 1


def test_errors_say_which_edit_and_which_item(session):
    with pytest.raises(dynmesh.InvalidArgumentError, match=r"\(edit 1, index 2\)"), session.edit() as tx:
        tx.add_vertices([[0, 0, 0]])
        tx.add_vertices([[0, 0, 0], [1, 0, 0], [0, np.nan, 0]])
