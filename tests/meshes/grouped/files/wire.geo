// A round wire of radius 5 and length 20 (um), the lower half of another material; made into wire.msh by
// gmsh wire.geo -3 -order 2 -format msh41
SetFactory("OpenCASCADE");
Cylinder(1) = {0, 0, 0, 0, 0, 10, 5};
Cylinder(2) = {0, 0, 10, 0, 0, 10, 5};
Coherence;
Mesh.MeshSizeMin = 7;
Mesh.MeshSizeMax = 7;
Mesh.HighOrderOptimize = 2;
Physical Volume("lower") = {1};
Physical Volume("upper") = {2};
eps = 0.01;
Physical Surface("near") = Surface In BoundingBox {-5 - eps, -5 - eps, -eps, 5 + eps, 5 + eps, eps};
Physical Surface("joint") = Surface In BoundingBox {-5 - eps, -5 - eps, 10 - eps, 5 + eps, 5 + eps, 10 + eps};
Physical Surface("far") = Surface In BoundingBox {-5 - eps, -5 - eps, 20 - eps, 5 + eps, 5 + eps, 20 + eps};
Physical Curve("rim") = Curve In BoundingBox {-5 - eps, -5 - eps, -eps, 5 + eps, 5 + eps, eps};
