// mesh_file.h: triangle meshes from files that other programs wrote.
//
// What is read, and how:
//  - The format goes by the name's extension, else by the content.
//  - Polygons are split into triangles: quadrilaterals along the better diagonal, larger ones by
//    clipping ears. A corner said twice in a row in a polygon is one corner; a triangle is kept.
//  - OBJ, PLY and OFF keep the file's vertices, their numbers and every bit of their positions,
//  also
//    where vertices stand on one place or are not used: pliant_mesh_check then says what is wrong.
//  - STL and what the import library reads have no vertex numbers that anybody knows: equal
//  positions
//    become one vertex, numbered by first appearance, and triangles that collapse by that are
//    dropped.
//  - A number that is not finite is refused here, where its line is known.
#pragma once

#include "pliant/mesh.h"

// Read OBJ, PLY (ascii, either endianness), STL (ascii, binary), OFF, or what the import library
// adds, by content and name. Messages name the file, the line or element, and the reason:
// "bunny.obj:812: face refers to vertex 99999 of 35947", vertices and faces numbered as in the
// file.
PLIANT_UNUSED_RESULT pliant_status pliant_mesh_file_read(const char *path, pliant_mesh **mesh,
                                                         pliant_error *err);
