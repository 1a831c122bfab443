// A plate with a round hole right through it, for the demo (drag_hole.py), which tells gmsh where the hole is:
//
//   gmsh -3 plate_with_hole.geo -setnumber hole_x 3 -setnumber radius 0.8 -o plate_with_hole.msh
SetFactory("OpenCASCADE");

DefineConstant[
  length = 12,
  width = 6,
  thickness = 0.6,
  hole_x = 3,
  hole_y = 3,
  radius = 0.8,
  edge_length = 0.14  // about 70,000 tetrahedra
];

Box(1) = {0, 0, 0, length, width, thickness};
Cylinder(2) = {hole_x, hole_y, 0, 0, 0, thickness, radius};
BooleanDifference(3) = { Volume{1}; Delete; }{ Volume{2}; Delete; };
Physical Volume("plate") = {3};

Mesh.CharacteristicLengthMin = edge_length;
Mesh.CharacteristicLengthMax = edge_length;
Mesh.Optimize = 1;
