// The parts of `restage stream` that touch no network: frames in bytes, the mailbox, the grid of
// time, the latency meter; and VMC bundles as a receiver of liblo's reads them.
#include <gtest/gtest.h>
#include <lo/lo.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstring>
#include <limits>
#include <map>
#include <thread>

#include "autograd/base/error.h"
#include "infer/live/frame_parser.h"
#include "infer/live/latency.h"
#include "infer/live/sender_clock.h"
#include "infer/live/server.h"
#include "infer/live/timeline.h"
#include "infer/live/vmc.h"
#include "tests/infer/live_support.h"
#include "tests/support/tiny_body.h"

namespace restage::live {
namespace {

using Kind = Step::Kind;

std::string frame_bytes(double seconds, const Points& points) {
  std::string out(kFrameHead, '\0');
  const auto count = static_cast<uint32_t>(points.size());
  std::memcpy(out.data(), &count, 4);
  std::memcpy(out.data() + 4, &seconds, 8);
  for (const Point& p : points) out.append(reinterpret_cast<const char*>(p.data()), 12);
  return out;
}

TEST(LiveFrames, AreTheSameHoweverTheBytesAreCut) {
  const std::string bytes =
      frame_bytes(1.5, {{1, 2, 3}, {4, 5, 6}}) + frame_bytes(2.5, {}) + frame_bytes(3, {{7, 8, 9}});
  for (const size_t piece : {1, 5, 12, 13, 1000}) {
    const Parsed got = parsed(bytes, piece);
    ASSERT_EQ(got.clouds.size(), 3u) << piece;
    EXPECT_EQ(got.clouds[0].seconds, 1.5);
    EXPECT_EQ(got.clouds[0].points, (Points{{1, 2, 3}, {4, 5, 6}}));
    EXPECT_TRUE(got.clouds[1].points.empty());
    EXPECT_EQ(got.clouds[2].points, (Points{{7, 8, 9}}));
    EXPECT_FALSE(got.in_frame);
    EXPECT_EQ(got.garbage + (got.refused.empty() ? "" : got.refused[0]), "");
  }
}

TEST(LiveFrames, ACutFrameIsNoFrame) {
  const std::string bytes = frame_bytes(1, {{1, 2, 3}, {4, 5, 6}});
  for (size_t left = 1; left < bytes.size(); ++left) {
    const Parsed got = parsed(bytes.substr(0, left), 7);
    EXPECT_TRUE(got.clouds.empty() && got.in_frame) << left;
  }
}

TEST(LiveFrames, GarbageIsToldApart) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const Parsed holes = parsed(frame_bytes(1, {{1, 2, nan}, {4, 5, 6}, {nan, 0, 0}}), 9);
  ASSERT_EQ(holes.clouds.size(), 1u);
  EXPECT_EQ(holes.clouds[0].points, (Points{{4, 5, 6}}));
  EXPECT_EQ(holes.clouds[0].left_out, 2u);
  // A time that is none costs its frame only.
  const Parsed timeless = parsed(frame_bytes(nan, {{1, 2, 3}}) + frame_bytes(2, {{1, 2, 3}}), 8);
  EXPECT_EQ(timeless.clouds.size(), 1u);
  EXPECT_EQ(timeless.refused.size(), 1u);
  // An absurd count costs all, and takes no memory.
  const Parsed absurd = parsed(std::string(100, '\xff'), 3);
  EXPECT_NE(absurd.garbage.find("4294967295 points"), std::string::npos) << absurd.garbage;
  EXPECT_TRUE(absurd.clouds.empty());
}

TEST(LiveMailbox, KeepsTheNewest) {
  Mailbox box;
  LiveCloud cloud;
  EXPECT_FALSE(box.take(cloud, std::chrono::milliseconds(1)));
  for (const double t : {1., 2., 3.}) {
    cloud = {};
    cloud.seconds = t;
    box.put(cloud);
  }
  box.pass(4);
  box.refuse();
  box.leave_out();
  ASSERT_TRUE(box.take(cloud, std::chrono::milliseconds(1)));
  EXPECT_EQ(cloud.seconds, 3);
  const Mailbox::Counts counts = box.counts();
  EXPECT_EQ(counts.arrived, 9);
  EXPECT_EQ(counts.overtaken, 6);
  EXPECT_EQ(counts.refused, 1);
  EXPECT_EQ(counts.other_sender, 1);
  // What was put last is still taken when nothing more will come.
  box.put(cloud);
  box.close();
  EXPECT_FALSE(box.ended());
  EXPECT_TRUE(box.take(cloud, std::chrono::milliseconds(1)));
  EXPECT_TRUE(box.ended());
}

TEST(LiveMailbox, WakesWhoWaits) {
  Mailbox box;
  std::thread late([&] {
    LiveCloud cloud;
    cloud.seconds = 7;
    box.put(cloud);
  });
  LiveCloud got;
  EXPECT_TRUE(box.take(got, std::chrono::seconds(20)));
  EXPECT_EQ(got.seconds, 7);
  late.join();
}

/// Steps of clouds at these times of one sender.
std::vector<Step> steps(const std::vector<double>& times) {
  Timeline line;
  std::vector<Step> out;
  for (const double t : times) out.push_back(line.place(t, 1));
  return out;
}

TEST(LiveTimeline, ThirtyASecondIsOneMomentACloudAlsoWhenItTrembles) {
  for (const double rate : {29.97, 30.0, 30.2})
    for (const double start : {0.0, 1.7e9}) {
      Timeline line;
      int64_t missed = 0, late = 0;
      for (int k = 0; k < 3000; ++k) {
        const double tremble = 0.009 * std::sin(12.9 * k);
        const Step step = line.place(start + k / rate + tremble, 1);
        missed += step.missed;
        late += step.kind == Kind::late || step.kind == Kind::early;
        EXPECT_EQ(step.kind == Kind::anew, k == 0);
      }
      EXPECT_EQ(missed, 0) << rate;
      EXPECT_EQ(late, 0) << rate;
    }
}

TEST(LiveTimeline, OtherRatesKeepTheirPace) {
  for (const double rate : {10., 15., 24., 25., 60., 90.}) {
    Timeline line;
    int64_t moments = 0;
    const int count = static_cast<int>(20 * rate);
    for (int k = 0; k <= count; ++k) {
      const Step step = line.place(k / rate, 1);
      if (step.kind == Kind::next) moments += 1 + step.missed;
    }
    EXPECT_NEAR(static_cast<double>(moments), 600, 2) << rate;
  }
}

TEST(LiveTimeline, GapsAndClocksThatJump) {
  Timeline line;
  const auto gap = steps({0, 5 / 30., 6 / 30.});
  EXPECT_EQ(gap[1].missed, 4);
  EXPECT_EQ(gap[2].missed, 0);
  EXPECT_EQ(steps({0, 11 / 30.})[1].kind, Kind::next);
  EXPECT_EQ(steps({0, 13 / 30.})[1].kind, Kind::anew);
  EXPECT_EQ(steps({0, 0})[1].kind, Kind::late);
  EXPECT_EQ(steps({0, 1 / 30., 2 / 30., 0})[3].kind, Kind::late);
  EXPECT_EQ(steps({5, 0})[1].kind, Kind::anew);
  // Of the same moment, but newer: it stands for the next one, if no other comes.
  line = {};
  line.place(0, 1);
  const Step early = line.place(0.01, 1);
  EXPECT_EQ(early.kind, Kind::early);
  EXPECT_NEAR(early.wait, 1 / 30. - 0.01, 1e-9);
  line.take_early();
  EXPECT_EQ(line.place(2 / 30., 1).missed, 0);
  EXPECT_EQ(steps({0, 1e300})[1].kind, Kind::anew);
  EXPECT_EQ(steps({-1e300, 1e300, 1e300 + 1})[1].kind, Kind::anew);
  line = {};  // another sender has another clock
  line.place(0, 1);
  EXPECT_EQ(line.place(1 / 30., 2).kind, Kind::anew);
}

/// Seconds that a clock gives for clouds that are captured `apart` seconds apart, by our clock, and
/// whose times lie `step` apart.
std::vector<double> seconds_of(double step, double apart, int count = 12) {
  SenderClock clock;
  Words words;
  LiveCloud cloud;
  std::vector<double> out;
  for (int k = 0; k < count; ++k) {
    cloud.seconds = 5000 + k * step;
    cloud.arrived = Clock::time_point() + std::chrono::duration_cast<Clock::duration>(
                                              std::chrono::duration<double>(k * apart));
    out.push_back(clock.seconds(cloud, words));
  }
  return out;
}

TEST(LiveSenderClock, MillisecondsAndNanosecondsAreRecognised) {
  for (const double unit : {1e3, 1e6, 1e9}) {
    const auto made = seconds_of(unit / 30, 1.0 / 30);
    for (size_t k = 5; k < made.size(); ++k)
      EXPECT_NEAR(made[k] - made[k - 1], 1.0 / 30, 1e-6) << unit << " " << k;
  }
}

TEST(LiveSenderClock, SecondsStaySeconds) {
  for (const double apart : {1.0 / 90, 1.0 / 30, 0.5, 2.0}) {
    const auto made = seconds_of(apart, apart);
    for (size_t k = 0; k < made.size(); ++k)
      EXPECT_EQ(made[k], 5000 + static_cast<double>(k) * apart);
  }
  const auto at_once = seconds_of(1, 1e-5);  // a pipe that does not wait
  EXPECT_EQ(at_once.back(), 5011);
  const auto frames = seconds_of(1, 1.0 / 30);  // a clock that counts frames
  EXPECT_EQ(frames.back(), 5011);
}

TEST(LiveLatency, QuantilesToOnePercentAndTheLongestExactly) {
  LatencyMeter meter;
  EXPECT_EQ(meter.quantile(0.5), 0);
  for (int k = 1; k <= 1000; ++k) meter.add(0.1 * k);
  EXPECT_NEAR(meter.quantile(0.5), 50, 0.5);
  EXPECT_NEAR(meter.quantile(0.99), 99, 1);
  EXPECT_EQ(meter.longest(), 0.1 * 1000);
  EXPECT_LE(meter.quantile(1), meter.longest());
  LatencyMeter wide;
  for (const double t : {0.0, 1e9}) wide.add(t);
  EXPECT_LE(wide.quantile(0.5), 0.0101);
  EXPECT_EQ(wide.quantile(1), 1e9);
}

TEST(LivePlaces, AsUsersWriteThem) {
  EXPECT_EQ(parse_place("39539", "--vmc").text(), "127.0.0.1:39539");
  EXPECT_EQ(parse_place(":80", "--ws").text(), "127.0.0.1:80");
  EXPECT_EQ(parse_place("[::1]:80", "--ws").text(), "[::1]:80");
  EXPECT_TRUE(resolved(parse_place("localhost:80", "--ws"), "--ws").loopback());
  EXPECT_FALSE(parse_place("0.0.0.0:80", "--ws").loopback());
  for (const char* bad : {"", "127.0.0.1", "localhost:", "a:0", "a:65536", "a:-1", "a:1x", "a: 1"})
    EXPECT_THROW(parse_place(bad, "--vmc"), InputError) << bad;
  EXPECT_THROW(resolved({"no.such.host.invalid", 1}, "--vmc"), InputError);
  const Listener first({"127.0.0.1", 0}, "--in");  // any free port
  EXPECT_GE(first.fd(), 0);
}

// ---- VMC ----------------------------------------------------------------------------------------

Pose some_pose() {
  Pose pose;
  for (size_t j = 0; j < kJoints; ++j) {
    const Vec3 axis(std::sin(1.0 + j), std::cos(2.0 * j), std::sin(3.0 * j + 0.5));
    pose.local[j] = Eigen::AngleAxisd(0.1 + 0.15 * j, axis.normalized()).toRotationMatrix();
  }
  pose.root = {0.4, 0.9, -1.2};
  return pose;
}

BoneSet bones_without(std::initializer_list<int> lacking) {
  BoneSet out;
  out.fill(true);
  for (const int j : lacking) out[static_cast<size_t>(j)] = false;
  return out;
}

/// Where a program puts the bones that hangs each in its parent among `sent`.
std::map<std::string, Eigen::Affine3f> composed(const std::vector<VmcBone>& bones,
                                                const BoneSet& sent) {
  std::map<std::string, Eigen::Affine3f> out;
  std::map<std::string, size_t> number;
  for (size_t j = 0; j < kJoints; ++j) number[std::string(kUnityBones[j])] = j;
  for (const VmcBone& bone : bones) {
    int parent = kParents[number.at(std::string(bone.name))];
    while (parent >= 0 && !sent[static_cast<size_t>(parent)])
      parent = kParents[static_cast<size_t>(parent)];
    const Eigen::Affine3f at = Eigen::Translation3f(bone.position) * bone.rotation;
    out[std::string(bone.name)] =
        parent < 0 ? at : out.at(std::string(kUnityBones[static_cast<size_t>(parent)])) * at;
  }
  return out;
}

TEST(LiveVmc, BonesStandWhereKinematicsPutsThemMirrored) {
  const Joints rest = testing::tiny_joints();
  const Pose pose = some_pose();
  const PosedSkeleton truth = forward_kinematics(rest, pose);
  const Eigen::DiagonalMatrix<float, 3> mirror(-1, 1, 1);
  const BoneSet all = bones_without({});
  const auto world = composed(vmc_bones(rest, pose, all), all);
  ASSERT_EQ(world.size(), 22u);
  for (size_t j = 0; j < kJoints; ++j) {
    const Eigen::Affine3f& bone = world.at(std::string(kUnityBones[j]));
    EXPECT_LT((bone.translation() - mirror * truth.joints[j].cast<float>()).norm(), 1e-5) << j;
    const Eigen::Matrix3f turn = mirror * truth.global[j].cast<float>() * mirror;
    EXPECT_LT((bone.linear() - turn).norm(), 1e-5) << j;
  }
}

TEST(LiveVmc, TurnsOfBonesThatLackGoOn) {
  const Joints rest = testing::tiny_joints();
  const Pose pose = some_pose();
  const PosedSkeleton truth = forward_kinematics(rest, pose);
  const BoneSet sent = bones_without({kSpine3, kLeftCollar, kLeftFoot});
  const auto bones = vmc_bones(rest, pose, sent);
  ASSERT_EQ(bones.size(), 19u);
  const auto world = composed(bones, sent);
  const Eigen::DiagonalMatrix<float, 3> mirror(-1, 1, 1);
  for (const int j : {kHead, kLeftWrist, kRightWrist}) {
    const auto k = static_cast<size_t>(j);
    const Eigen::Matrix3f turn = mirror * truth.global[k].cast<float>() * mirror;
    EXPECT_LT((world.at(std::string(kUnityBones[k])).linear() - turn).norm(), 1e-5) << j;
  }
}

TEST(LiveVmc, ATPoseIsTheIdentity) {
  Pose pose;
  pose.local.fill(Mat3::Identity());
  for (const VmcBone& bone : vmc_bones(testing::tiny_joints(), pose, bones_without({}))) {
    EXPECT_LT((bone.rotation.coeffs() - Eigen::Quaternionf::Identity().coeffs()).norm(), 1e-6);
    if (bone.name == "LeftUpperArm") {
      EXPECT_LT(bone.position.x(), 0);  // Unity's x is the right
    }
  }
}

/// Everything that arrives at a port, by address; messages of bones by the bone's name, too.
struct Received {
  std::map<std::string, std::vector<float>> numbers;
  std::map<std::string, int> times;
  int bundles = 0;
};

int hear(const char* path, const char* types, lo_arg** argv, int argc, lo_message, void* user) {
  auto& got = *static_cast<Received*>(user);
  std::string key = path;
  std::vector<float> numbers;
  for (int k = 0; k < argc; ++k) {
    // liblo hands out the message's own bytes, which lie on no boundary of a lo_arg.
    const char* bytes = reinterpret_cast<const char*>(argv[k]);
    float single = 0;
    int32_t whole = 0;
    if (types[k] == 's') key += std::string(" ") + bytes;
    if (types[k] == 'f') numbers.push_back((std::memcpy(&single, bytes, 4), single));
    if (types[k] == 'i')
      numbers.push_back(static_cast<float>((std::memcpy(&whole, bytes, 4), whole)));
  }
  got.numbers[key] = numbers;
  ++got.times[key];
  return 0;
}

TEST(LiveVmc, ABundleIsReadByAReceiver) {
  Received got;
  lo_server server = lo_server_new_with_proto(nullptr, LO_UDP, nullptr);
  ASSERT_NE(server, nullptr);
  lo_server_add_method(server, nullptr, nullptr, hear, &got);
  lo_server_add_bundle_handlers(
      server,
      [](lo_timetag, void* user) {
        ++static_cast<Received*>(user)->bundles;
        return 0;
      },
      nullptr, &got);
  const auto port = static_cast<uint16_t>(lo_server_get_port(server));
  const Joints rest = testing::tiny_joints();
  const Pose pose = some_pose();
  VmcSender sender({"127.0.0.1", port}, rest, bones_without({}));
  EXPECT_EQ(sender.send(pose, 2.5), "");
  ASSERT_GT(lo_server_recv_noblock(server, 2000), 0);
  EXPECT_EQ(got.bundles, 1);
  EXPECT_EQ(got.numbers["/VMC/Ext/OK"], (std::vector<float>{1, 3, 0, 1}));
  EXPECT_EQ(got.numbers["/VMC/Ext/T"], std::vector<float>{2.5f});
  EXPECT_EQ(got.numbers["/VMC/Ext/Root/Pos root"], (std::vector<float>{0, 0, 0, 0, 0, 0, 1}));
  for (const VmcBone& bone : vmc_bones(rest, pose, bones_without({}))) {
    const std::string key = "/VMC/Ext/Bone/Pos " + std::string(bone.name);
    const Eigen::Quaternionf& q = bone.rotation;
    const Eigen::Vector3f& p = bone.position;
    EXPECT_EQ(got.numbers[key],
              (std::vector<float>{p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w()}))
        << key;
    EXPECT_EQ(got.times[key], 1);
  }
  lo_server_free(server);
}

TEST(LiveVmc, SendsToBothKindsOfAddresses) {
  for (const char* host : {"127.0.0.1", "::1"}) {
    const bool v6 = host[0] == ':';
    const int fd = socket(v6 ? AF_INET6 : AF_INET, SOCK_DGRAM, 0);
    sockaddr_storage where{};
    where.ss_family = v6 ? AF_INET6 : AF_INET;
    if (v6) reinterpret_cast<sockaddr_in6&>(where).sin6_addr = in6addr_loopback;
    socklen_t size = v6 ? sizeof(sockaddr_in6) : sizeof(sockaddr_in);
    const timeval patience{2, 0};
    setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    if (fd < 0 || bind(fd, reinterpret_cast<sockaddr*>(&where), size) != 0) {
      close(fd);
      GTEST_SKIP() << "this machine has no address " << host;
    }
    getsockname(fd, reinterpret_cast<sockaddr*>(&where), &size);
    const uint16_t port = ntohs(v6 ? reinterpret_cast<sockaddr_in6&>(where).sin6_port
                                   : reinterpret_cast<sockaddr_in&>(where).sin_port);
    VmcSender sender({host, port}, testing::tiny_joints(), bones_without({}));
    EXPECT_EQ(sender.send(some_pose(), 0), "");
    char bytes[8];
    ASSERT_EQ(recv(fd, bytes, sizeof bytes, 0), 8) << host;
    EXPECT_EQ(std::memcmp(bytes, "#bundle", 8), 0);
    close(fd);
  }
}

TEST(LivePage, AMessageIsWhatItsHeaderSays) {
  const std::string bytes = frame_message(1.25, 0.5, {{1, 2, 3}, {4, 5, 6}});
  ASSERT_EQ(bytes.size(), 16u + 24u);
  double seconds = 0;
  float sure = 0, z = 0;
  uint32_t count = 0;
  std::memcpy(&seconds, bytes.data(), 8);
  std::memcpy(&sure, bytes.data() + 8, 4);
  std::memcpy(&count, bytes.data() + 12, 4);
  std::memcpy(&z, bytes.data() + 36, 4);
  EXPECT_EQ(seconds, 1.25);
  EXPECT_EQ(sure, 0.5f);
  EXPECT_EQ(count, 2u);
  EXPECT_EQ(z, 6.0f);
}

}  // namespace
}  // namespace restage::live
