// A page that shows the character while it moves: HTTP and WebSocket on one port.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "infer/live/place.h"
#include "nn/geometry/body.h"

namespace restage::live {

/// A frame as one binary message, little-endian:
///   float64  seconds since the stream began
///   float32  confidence, 0 to 1; NaN: no estimate
///   uint32   number of vertices
///   float32  x, y, z of each vertex, world, metres, y up, right-handed
std::string frame_message(double seconds, double confidence, const Points& vertices);

/// Serves `page` at / and sends every frame to all WebSockets. A client that is slow gets the
/// newest frame and misses others, so memory does not grow. The server answers
/// to addresses and to the machine's own name only, and only its own page may connect, besides
/// whoever is no browser: pages of other origins read nothing.
class PageServer {
 public:
  /// `where`: resolved(). InputError naming `option` as Listener.
  PageServer(const Place& where, const std::string& option, std::string page);
  ~PageServer();
  PageServer(const PageServer&) = delete;
  PageServer& operator=(const PageServer&) = delete;
  void send(std::string message);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace restage::live
