"""The parts of the demo `drag_hole.py`, in the order in which it needs them.

source      the mesh: gmsh's or a file          survey     what a mesh is, before and after
region      what is dragged, along which path   simulation one step: move, split, collapse, swap, smooth
elements    quality and size of elements        patch      the neighbourhood of what moves, as it is now
wear        edges that a move leaves too long   remedies   operators that might better poor elements
            or too short                        operators  what was asked for, and what became of it
followers   mirrors in processes of their own   report     aligned tables, a list of checks
results     what they show and check            picture    the surface as PNG and VTU
"""
