#pragma once

namespace mine {
/// Whether a network of one's own learns, and moves a mesh.
bool trains_and_answers();
}  // namespace mine
