// Senders of clouds as they are met: in pieces, silent, with garbage, vanished; and a folder that
// is being written.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <fstream>

#include "autograd/base/error.h"
#include "infer/live/folder_input.h"

namespace restage::live {
namespace {

namespace fs = std::filesystem;

std::string one_frame(float seconds, uint32_t points = 2) {
  std::string out(kFrameHead + 12 * points, '\0');
  const double time = seconds;
  std::memcpy(out.data(), &points, 4);
  std::memcpy(out.data() + 4, &time, 8);
  return out;
}

/// A client of a port of this machine.
class Client final {
 public:
  explicit Client(uint16_t port) : fd_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(port);
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(connect(fd_, reinterpret_cast<sockaddr*>(&to), sizeof to), 0);
  }
  ~Client() { close(fd_); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;
  void send(const std::string& bytes) const {
    EXPECT_EQ(write(fd_, bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
  }
  /// Whether the other side has closed the connection, within two seconds.
  bool closed() const {
    const timeval patience{2, 0};
    setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    char byte;
    const ssize_t got = read(fd_, &byte, 1);
    return got == 0 || (got < 0 && errno == ECONNRESET);
  }

 private:
  int fd_;
};

class LiveInput : public ::testing::Test {
 protected:
  void listen() {
    auto listener = std::make_unique<Listener>(Place{"127.0.0.1", 0}, "--in");
    sockaddr_in where{};
    socklen_t size = sizeof where;
    getsockname(listener->fd(), reinterpret_cast<sockaddr*>(&where), &size);
    port_ = ntohs(where.sin_port);
    reading_.emplace(std::make_unique<SocketInput>(std::move(listener)), box_, words_);
  }
  /// The time of the next cloud, -1: none came.
  double next(int milliseconds = 3000) {
    return box_.take(cloud_, std::chrono::milliseconds(milliseconds)) ? cloud_.seconds : -1;
  }

  uint16_t port_ = 0;
  Mailbox box_;
  Words words_;
  LiveCloud cloud_;
  std::optional<Reading> reading_;
};

TEST_F(LiveInput, ASenderInPiecesThenAnother) {
  listen();
  {
    const Client first(port_);
    const std::string bytes = one_frame(1);
    first.send(bytes.substr(0, 20));
    EXPECT_EQ(next(50), -1);
    first.send(bytes.substr(20));
    EXPECT_EQ(next(), 1);
    first.send(one_frame(2).substr(0, 30));  // and vanishes
  }
  const int64_t before = cloud_.sender;
  const Client second(port_);
  second.send(one_frame(5));
  EXPECT_EQ(next(), 5);
  EXPECT_NE(cloud_.sender, before);
}

TEST_F(LiveInput, GarbageClosesItsSenderOnly) {
  listen();
  const Client garbage(port_);
  garbage.send(std::string(400, '\xee'));
  EXPECT_TRUE(garbage.closed());
  const Client good(port_);
  good.send(one_frame(3));
  EXPECT_EQ(next(), 3);
}

TEST_F(LiveInput, AStalledSenderIsReplacedByOneThatSendsAFrame) {
  listen();
  const Client stalled(port_), idle(port_);
  stalled.send(one_frame(1) + one_frame(2).substr(0, 9));
  EXPECT_EQ(next(), 1);
  std::this_thread::sleep_for(kSilence + std::chrono::milliseconds(100));
  const Client fresh(port_);
  fresh.send(one_frame(7).substr(0, 15));  // no whole frame: nobody is replaced
  EXPECT_EQ(next(50), -1);
  fresh.send(one_frame(7).substr(15));
  EXPECT_EQ(next(), 7);
  stalled.send(one_frame(2).substr(9));  // comes too late
  EXPECT_EQ(next(50), -1);
  fresh.send(one_frame(8));
  EXPECT_EQ(next(), 8);
}

TEST_F(LiveInput, TwoThatSendDoNotDeposeEachOther) {
  listen();
  auto first = std::make_unique<Client>(port_);
  first->send(one_frame(1));
  EXPECT_EQ(next(), 1);
  const Client second(port_);
  for (const float seconds : {2.f, 3.f, 4.f}) {
    second.send(one_frame(100 + seconds));
    EXPECT_EQ(next(50), -1) << "the first one is sending";
    first->send(one_frame(seconds));
    EXPECT_EQ(next(), seconds);
  }
  EXPECT_EQ(box_.counts().arrived, 7);
  EXPECT_EQ(box_.counts().other_sender, 3);
  first.reset();
  second.send(one_frame(105));
  EXPECT_EQ(next(), 105) << "the first one has ended";
}

TEST_F(LiveInput, ManyConnectionsThatSayNothingDoNotLockTheDoor) {
  listen();
  std::vector<std::unique_ptr<Client>> silent;
  for (int k = 0; k < 20; ++k) silent.push_back(std::make_unique<Client>(port_));
  const Client good(port_);
  good.send(one_frame(1));
  EXPECT_EQ(next(), 1);
}

TEST_F(LiveInput, APipeEndsWithItsBytesAndTheLastFrameIsKept) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  reading_.emplace(std::make_unique<PipeInput>(ends[0], "pipe"), box_, words_);
  const std::string bytes = one_frame(1) + one_frame(2) + one_frame(3).substr(0, 25);
  ASSERT_EQ(write(ends[1], bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
  close(ends[1]);
  while (next() != 2) ASSERT_FALSE(box_.ended());
  EXPECT_EQ(next(), -1);
  EXPECT_TRUE(box_.ended());
  reading_.reset();
  close(ends[0]);
}

TEST_F(LiveInput, StopsWhileASenderIsSilent) {
  listen();
  const Client silent(port_);
  const auto start = Clock::now();
  reading_.reset();
  EXPECT_LT(Clock::now() - start, std::chrono::seconds(2));
  EXPECT_TRUE(box_.ended());
}

/// Files are numbers as text here, which is the x of their one point; "x" at the end is missing
/// from one half written.
class LiveFolder : public LiveInput {
 protected:
  void SetUp() override {
    folder_ = (fs::temp_directory_path() / ("restage-live-" + std::to_string(getpid()))).string();
    fs::remove_all(folder_);
    fs::create_directory(folder_);
  }
  void TearDown() override {
    reading_.reset();
    fs::remove_all(folder_);
  }
  void watch() {
    FolderFiles files{[](const std::string& name) { return name.ends_with(".n"); },
                      [](const std::string& a, const std::string& b) {
                        return a.size() < b.size() || (a.size() == b.size() && a < b);
                      },
                      [](const std::string& path, LiveCloud& into) {
                        std::ifstream file(path);
                        std::string text;
                        file >> text;
                        if (!text.ends_with("x")) throw InputError(path, "is cut", "wait");
                        into.points = {Point(std::stof(text), 0, 0)};
                        return int64_t{0};
                      }};
    reading_.emplace(std::make_unique<FolderInput>(folder_, std::move(files)), box_, words_);
  }
  void put(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ + "/" + name) << text;
  }
  float next_x(int milliseconds = 3000) {
    return next(milliseconds) < 0 ? -1 : cloud_.points.at(0).x();
  }
  std::string folder_;
};

TEST_F(LiveFolder, TakesTheLastOfWhatIsThereAndThenWhatComes) {
  put("2.n", "2x");
  put("10.n", "10x");
  put("9.n", "9x");
  put("notes.txt", "77x");
  watch();
  EXPECT_EQ(next_x(), 10);
  EXPECT_EQ(box_.counts().arrived, 3);
  EXPECT_EQ(box_.counts().overtaken, 2);
  put("11.n", "11x");
  EXPECT_EQ(next_x(), 11);
  put("12.tmp", "12x");
  EXPECT_EQ(next_x(150), -1);
  fs::rename(folder_ + "/12.tmp", folder_ + "/12.n");
  EXPECT_EQ(next_x(), 12);
  put("12.n", "13x");  // one file, written again and again
  EXPECT_EQ(next_x(), 13);
}

TEST_F(LiveFolder, AFileIsTakenWhenItIsWholeOnly) {
  watch();
  {
    std::ofstream slow(folder_ + "/1.n");
    slow << "1" << std::flush;
    EXPECT_EQ(next_x(150), -1);
    slow << "x";
  }
  EXPECT_EQ(next_x(), 1);
  put("2.n", "2");  // closed half written, then written whole
  EXPECT_EQ(next_x(150), -1);
  put("2.n", "2x");
  EXPECT_EQ(next_x(), 2);
  EXPECT_EQ(box_.counts().refused, 0);
  put("3.n", "3");  // never whole
  for (int k = 0; k < 50 && box_.counts().refused == 0; ++k) EXPECT_EQ(next_x(100), -1);
  EXPECT_EQ(box_.counts().refused, 1);
  put("4.n", "4x");
  EXPECT_EQ(next_x(), 4);
}

TEST_F(LiveFolder, AFolderThatGoesAwayMayComeBack) {
  watch();
  put("1.n", "1x");
  EXPECT_EQ(next_x(), 1);
  fs::remove_all(folder_);
  EXPECT_EQ(next_x(200), -1);
  fs::create_directory(folder_);
  put("2.n", "2x");
  EXPECT_EQ(next_x(), 2);
}

}  // namespace
}  // namespace restage::live
