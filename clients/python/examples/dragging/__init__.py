"""The parts of the demo `drag_hole.py`, in the order in which it needs them.

source      the mesh: gmsh's or a file          survey     what a mesh is, before and after
region      what is dragged, along which path   simulation one step: read, move, repair, commit
elements    quality, size, faces of elements    patch      the neighbourhood that moves, and its batch
cavities    repairs of tetrahedra, triangles    fans       repairs of all other elements
followers   mirrors in processes of their own   report     aligned tables, a list of checks
results     what they show and check            picture    the surface as PNG and VTU
"""
