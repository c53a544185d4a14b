// All of it highp. Positions, texture coordinates on 4096 texels and window coordinates need it; the network too: in half
// precision its products lose up to two decimal digits, and large weights overflow.
precision highp float;
precision highp int;
precision highp sampler2D;
