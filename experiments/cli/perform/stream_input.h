// Where `restage stream` hears of somebody, and where it sends what it makes of it.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "experiments/cli/perform/retarget.h"
#include "infer/live/input.h"

namespace restage::cli {

struct StreamCommand {
  RetargetCommand how;
  std::string in, vmc, ws;
  std::optional<double> seconds;
  /// Whether the source is a folder: neither standard input nor a socket.
  bool folder() const;
};

/// Where clouds come from, before anything is opened.
struct StreamPlaces {
  std::optional<live::Place> socket;  ///< else a folder, or standard input
  live::Place vmc;
  std::optional<live::Place> page;
};

/// InputError: an option that is out of range, an address that is none, a folder that is not there.
StreamPlaces check_stream(const StreamCommand& c);
std::unique_ptr<live::CloudInput> open_input(const StreamCommand& c, const StreamPlaces& places,
                                             uint64_t max_memory);
/// The line by which others know that the stream is ready, and warnings of open doors.
void say_places(const StreamCommand& c, const StreamPlaces& places);

}  // namespace restage::cli
