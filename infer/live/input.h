// Where clouds come from. Reading runs on a thread of its own and puts every cloud into a mailbox.
#pragma once

#include <memory>
#include <optional>
#include <thread>

#include "autograd/base/error.h"
#include "infer/live/frame_parser.h"
#include "infer/live/place.h"
#include "infer/live/words.h"

namespace restage::live {

/// So long a sender may say nothing before another one takes its place.
inline constexpr std::chrono::seconds kSilence{2};

class CloudInput {
 public:
  CloudInput() = default;
  CloudInput(const CloudInput&) = delete;
  CloudInput& operator=(const CloudInput&) = delete;
  virtual ~CloudInput() = default;
  /// Reads until the input ends, or until `stop`, a file descriptor, becomes readable. Trouble with
  /// a sender ends neither. InputError: nothing that came was a frame, and nobody else can come.
  virtual void run(int stop, Mailbox& to, Words& words) = 0;
};

/// Runs an input until it ends or this value does; then the mailbox is closed. The mailbox and the
/// words must live longer.
class Reading {
 public:
  Reading(std::unique_ptr<CloudInput> input, Mailbox& to, Words& words);
  ~Reading();
  Reading(const Reading&) = delete;
  Reading& operator=(const Reading&) = delete;

  /// Stops reading, and throws the input's InputError if there was one.
  void end();

 private:
  void stop();

  int stop_;
  std::optional<InputError> fault_;  ///< written by the thread, read when it is over
  std::unique_ptr<CloudInput> input_;
  std::thread thread_;
};

/// Frames (frame_parser.h) on a file descriptor, such as standard input, which is not closed. The
/// input ends where the bytes do, or where they stop making sense.
class PipeInput final : public CloudInput {
 public:
  PipeInput(int fd, std::string name) : fd_(fd), name_(std::move(name)) {}
  void run(int stop, Mailbox& to, Words& words) override;

 private:
  int fd_;
  std::string name_;
};

/// Frames on a socket that listens. Anybody may connect at any time.
/// One sender is heard at a time: the first that sends a whole frame.
/// Another sender takes its place with a whole frame, after the one that is heard has ended or has
/// been silent for kSilence. Until then clouds of others are left out, and a warning says so.
/// If a sender ends, vanishes or sends what makes no sense, a warning says so, and the input waits
/// for the next sender.
class SocketInput final : public CloudInput {
 public:
  explicit SocketInput(std::unique_ptr<Listener> listener) : listener_(std::move(listener)) {}
  void run(int stop, Mailbox& to, Words& words) override;

 private:
  std::unique_ptr<Listener> listener_;
};

}  // namespace restage::live
