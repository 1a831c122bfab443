"""Makes one edit through a daemon, and reads it back. Part of smoke.sh.

usage: smoke_edit.py TARGET
"""

import sys

import dynmesh

CORNERS = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]


def main() -> None:
    with dynmesh.connect(sys.argv[1]) as client:
        session = client.create_session("smoke")
        with session.edit() as tx:
            tx.add_elements("tetra", [tx.add_vertices(CORNERS)])
        assert tx.result.revision == 1, tx.result
        assert tx.result.counts == (4, 6, 4, 1), tx.result
        assert session.positions().tolist() == CORNERS
        assert session.snapshot().checksum() == tx.result.checksum
        print(f"one edit made: {session.info().counts} at revision {tx.result.revision}")


if __name__ == "__main__":
    main()
