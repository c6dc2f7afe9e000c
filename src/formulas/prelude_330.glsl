#version 330 core
/* GLSL 3.30: followed by prelude_glsl.glsl. */
