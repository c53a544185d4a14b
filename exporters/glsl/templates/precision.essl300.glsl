// All of it highp. Positions, texture coordinates on 4096 texels and window coordinates need it. The network does too:
// in half precision its error grows with the weights, which are whatever training made of them.
precision highp float;
precision highp int;
precision highp sampler2D;
