#pragma once

namespace mine {
/// Whether the gradient of an op of one's own is right.
bool checks_an_op();
/// Whether a network of one's own learns, and moves a mesh.
bool trains_and_answers();
}  // namespace mine
