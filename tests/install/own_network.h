#pragma once

namespace mine {
/// Whether the gradient of an op of one's own is right.
bool checks_an_op();
/// Whether an extractor of one's own learns in a run directory, and is read from there.
bool finds_joints();
/// Whether a network of one's own learns, and moves a mesh.
bool trains_and_answers();
}  // namespace mine
