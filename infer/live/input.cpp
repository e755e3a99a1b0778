#include "infer/live/input.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <list>
#include <vector>

#include "autograd/base/error.h"

namespace restage::live {
namespace {

constexpr size_t kChunk = 1 << 16;      // bytes that are read at once
constexpr size_t kMostConnections = 8;  // that are open at once

/// Says once that a sender is silent, when it has been for a while.
class Silence {
 public:
  bool lasts() const { return Clock::now() - last_ >= kSilence; }
  void heard() {
    last_ = Clock::now();
    said_ = false;
  }
  void check(bool in_frame, Words& words) {
    if (said_ || !lasts()) return;
    said_ = true;
    words.warn("silence", std::string("the sender has been silent for two seconds") +
                              (in_frame ? ", in the middle of a frame" : "") +
                              "; the stream waits");
  }

 private:
  Clock::time_point last_ = Clock::now();
  bool said_ = false;
};

/// A sender's bytes as clouds.
struct Sender {
  int fd = -1;
  int64_t number = 0;
  FrameParser parser = {};
  Silence silence = {};
  bool whole = false;  ///< it has sent a frame

  enum class State { open, ended, garbage };
  /// Reads what is there. `heard` is asked with every frame: whether the frame counts.
  State read(std::span<unsigned char> buffer, Mailbox& to, Words& words, const std::string& name,
             const std::function<bool()>& heard);
};

Sender::State Sender::read(std::span<unsigned char> buffer, Mailbox& to, Words& words,
                           const std::string& name, const std::function<bool()>& heard) {
  const ssize_t got = ::read(fd, buffer.data(), buffer.size());
  if (got < 0 && (errno == EINTR || errno == EAGAIN)) return State::open;
  const auto deliver = [&](LiveCloud& cloud) {
    whole = true;
    if (!heard()) return to.leave_out();
    cloud.sender = number;
    cloud.name = name;
    to.put(cloud);
  };
  if (got == 0) parser.end(Clock::now(), deliver);
  if (got <= 0) {
    const std::string how = got < 0             ? std::string("broke off: ") + std::strerror(errno)
                            : parser.in_frame() ? "ended in the middle of a frame"
                                                : "";
    if (!how.empty()) words.warn("cut", name + " " + how);
    return State::ended;
  }
  silence.heard();
  const auto refuse = [&](const std::string& why) {
    to.refuse();
    words.warn("refused", "a frame of " + name + " was left out: " + why);
  };
  const std::string garbage =
      parser.take(buffer.first(static_cast<size_t>(got)), Clock::now(), deliver, refuse);
  if (garbage.empty()) return State::open;
  words.warn("garbage", name + " sends what is no frame: " + garbage);
  return State::garbage;
}

/// Waits for any of them; false: it was told to stop.
bool wait_for(std::vector<pollfd>& all) {
  constexpr int kLongest = 250;  // milliseconds, so that silence is noticed
  if (poll(all.data(), all.size(), kLongest) < 0)
    for (pollfd& one : all) one.revents = 0;  // a signal
  return all[0].revents == 0;
}

}  // namespace

Reading::Reading(std::unique_ptr<CloudInput> input, Mailbox& to, Words& words)
    : stop_(eventfd(0, EFD_CLOEXEC)), input_(std::move(input)) {
  if (stop_ < 0) throw WorkError("cannot make an event descriptor");
  thread_ = std::thread([this, &to, &words] {
    try {
      input_->run(stop_, to, words);
    } catch (const InputError& error) {
      fault_ = error;
    } catch (const std::exception& error) {
      words.warn("reading", std::string("reading clouds has ended: ") + error.what());
    }
    to.close();
  });
}

Reading::~Reading() {
  stop();
  close(stop_);
}

void Reading::stop() {
  const uint64_t one = 1;
  if (thread_.joinable() && write(stop_, &one, sizeof one) == sizeof one) thread_.join();
}

void Reading::end() {
  stop();
  if (fault_) throw *fault_;
}

void PipeInput::run(int stop, Mailbox& to, Words& words) {
  std::vector<unsigned char> buffer(kChunk);
  Sender sender{.fd = fd_, .number = 1};
  std::vector<pollfd> all = {{stop, POLLIN, 0}, {fd_, POLLIN, 0}};
  while (wait_for(all)) {
    if (all[1].revents == 0) {
      sender.silence.check(sender.parser.in_frame(), words);
      continue;
    }
    const Sender::State state = sender.read(buffer, to, words, name_, [] { return true; });
    if (state == Sender::State::garbage && !sender.whole)
      throw InputError(name_, "holds no frame", "send frames as docs/stream.md says");
    if (state != Sender::State::open) return;
  }
}

namespace {

/// The connections of a socket, of which one is heard.
class Connections {
 public:
  Connections(int listener, Mailbox& to, Words& words)
      : listener_(listener), to_(to), words_(words), buffer_(kChunk) {}
  ~Connections() {
    for (const Sender& s : open_) close(s.fd);
  }
  Connections(const Connections&) = delete;
  Connections& operator=(const Connections&) = delete;

  void run(int stop) {
    std::vector<pollfd> all;
    do {
      const bool full = Clock::now() < full_until_;
      all = {{stop, POLLIN, 0}, {listener_, static_cast<short>(full ? 0 : POLLIN), 0}};
      for (const Sender& s : open_) all.push_back({s.fd, POLLIN, 0});
      if (!wait_for(all)) return;
      auto one = open_.begin();
      for (size_t k = 2; k < all.size(); ++k) one = serve(one, all[k].revents != 0);
      if (all[1].revents != 0) accept_one();
    } while (true);
  }

 private:
  std::list<Sender>::iterator serve(std::list<Sender>::iterator one, bool ready) {
    if (!ready) {
      one->silence.check(one->parser.in_frame(), words_);
      return std::next(one);
    }
    const auto state = one->read(buffer_, to_, words_, name_of(one->number),
                                 [&] { return is_heard(one->number); });
    if (state == Sender::State::open) return std::next(one);
    if (state == Sender::State::ended && !one->parser.in_frame())
      words_.warn("ended", name_of(one->number) + " has ended; the stream waits for the next");
    close(one->fd);
    return open_.erase(one);
  }

  static std::string name_of(int64_t number) { return "sender " + std::to_string(number); }

  /// Whether a sender that has just sent a whole frame is heard; it may take the place of another.
  bool is_heard(int64_t number) {
    if (number == heard_) return true;
    const auto other = std::find_if(open_.begin(), open_.end(),
                                    [&](const Sender& s) { return s.number == heard_; });
    if (other != open_.end() && !other->silence.lasts()) {
      words_.warn("not heard", name_of(number) + " is not heard: " + name_of(heard_) +
                                   " is sending; end one of the two");
      return false;
    }
    if (other != open_.end())
      words_.warn("taken over", name_of(number) + " takes the place of " + name_of(heard_));
    heard_ = number;
    return true;
  }

  void accept_one() {
    const int fd = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (fd < 0) {
      if (errno != EMFILE && errno != ENFILE) return;
      words_.warn("full", "no more connections can be opened: the system's limit is reached");
      full_until_ = Clock::now() + std::chrono::milliseconds(250);
      return;
    }
    if (open_.size() == kMostConnections) {  // those that never sent a frame go first
      auto oldest =
          std::find_if(open_.begin(), open_.end(), [](const Sender& s) { return !s.whole; });
      if (oldest == open_.end())
        oldest = std::find_if(open_.begin(), open_.end(),
                              [&](const Sender& s) { return s.number != heard_; });
      close(oldest->fd);
      open_.erase(oldest);
    }
    open_.push_back({.fd = fd, .number = ++last_});
  }

  int listener_;
  Mailbox& to_;
  Words& words_;
  std::vector<unsigned char> buffer_;
  std::list<Sender> open_;
  Clock::time_point full_until_{};  ///< nobody is let in until then
  int64_t last_ = 0;                ///< number of the last sender
  int64_t heard_ = 0;               ///< number of the sender that is heard; 0: none has been
};

}  // namespace

void SocketInput::run(int stop, Mailbox& to, Words& words) {
  Connections(listener_->fd(), to, words).run(stop);
}

}  // namespace restage::live
