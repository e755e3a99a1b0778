// Floors, walls and furniture in the pictures of one depth camera.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "datasets/importers/depth/walls.h"

namespace restage {

/// Points of a depth picture, each with its pixel.
struct PicturePoints {
  Points points;             ///< metres, y up, the camera at the origin, looking along -z
  std::vector<size_t> cell;  ///< which pixel of the grid that is looked at
  std::vector<float> depth;  ///< metres
};

/// Tells the person from the rest: floors and walls (walls.h) and what is behind them; pieces that
/// only show what their pixels usually show farthest away, where something else moves (where
/// nothing does: pieces that are not as high as somebody who stands); what lies apart from the
/// person (parts.h). Who stands still is no background.
class Background {
 public:
  /// `cells`: pixels of the grid.
  explicit Background(size_t cells) : seen_(cells), far_(cells, 0.0f) {}
  /// A frame of the recording; a few dozen that are spread over it, before any is judged.
  void look(const PicturePoints& frame);
  void settle();  ///< when all were looked at

  /// Points of the person, frame by frame in order.
  Points person_in(const PicturePoints& frame);
  /// Forgets where the person was, and what was counted.
  void restart();

  /// The floor that most frames show; nothing if they show none, or the camera moves.
  const std::optional<FlatPlane>& floor() const { return floor_; }
  /// Of the points so far: "61 % on floors and walls, 9 % on furniture, ...".
  std::string removed() const;

 private:
  void take_floor(const std::vector<Wall>& walls);
  bool is_resting(const PicturePoints& frame, size_t i) const;
  /// Pieces that no standing person fills, where others may be one: for frames that show no motion.
  void drop_low(const PicturePoints& frame, std::vector<size_t>& left) const;
  void drop_resting(const PicturePoints& frame, std::vector<size_t>& left) const;

  std::vector<std::vector<float>> seen_;  // depths by pixel, until settle()
  std::vector<float> far_;                // usual largest depth, metres; 0: not known
  size_t looks_ = 0;
  std::vector<FlatPlane> floors_;
  std::optional<FlatPlane> floor_;
  std::vector<Wall> walls_;  // of the frame before
  std::optional<Point> middle_;
  size_t all_ = 0, flat_ = 0, resting_ = 0, apart_ = 0;  // points
};

}  // namespace restage
