"""The parts of the demo `drag_hole.py`, from the shapes of elements to the picture at the end.

elements   quality, size and faces of elements            region     what is dragged, and along which path
patch      the neighbourhood that moves, as the service   cavities   repairs of tetrahedra and triangles
           describes it, and the batch that changes it    fans       repairs of all other elements
simulation one step: read, move, repair, commit           followers  mirrors in processes of their own
report     tables and checks                              picture    PNG and VTU of the result
"""
