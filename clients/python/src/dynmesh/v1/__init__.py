"""Messages and stubs of package dynmesh.v1, generated from proto/dynmesh/v1 by the build."""
