#include "infer/track/journal.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <limits>

#include "autograd/base/atomic_file.h"

namespace restage {
namespace {

constexpr size_t kPoseNumbers = 3 + 9 * kJoints;
constexpr size_t kNumbers = kPoseNumbers + 4;  // confidence, filled, two distances
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

std::optional<double> known(double x) {
  return std::isnan(x) ? std::nullopt : std::optional<double>(x);
}

}  // namespace

TrackJournal::TrackJournal(const std::string& folder, size_t points)
    : folder_(folder), path_(folder + "/frames"), state_path_(folder + "/state"), points_(points) {
  record_.resize(kNumbers * sizeof(double) + points_ * sizeof(Point));
  if (is_there(state_path_)) {
    const std::string all = read_file(state_path_);
    if (all.size() < sizeof frames_) throw InputError(state_path_, "is damaged", "remove it");
    std::memcpy(&frames_, all.data(), sizeof frames_);
    state_ = all.substr(sizeof frames_);
  }
  file_ = open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (file_ < 0) throw_refused(path_, "written", errno);
  const off_t kept = static_cast<off_t>(record_.size()) * frames_;
  if (lseek(file_, 0, SEEK_END) < kept) {
    close(file_);
    throw InputError(path_, "is shorter than its record says", "remove " + folder);
  }
  if (ftruncate(file_, kept) != 0 || lseek(file_, 0, SEEK_END) < 0)
    throw_refused(path_, "written", errno);
}

TrackJournal::~TrackJournal() { close(file_); }

void TrackJournal::append(const JournalFrame& frame) {
  std::array<double, kNumbers> numbers;
  std::copy_n(frame.pose.root.data(), 3, numbers.begin());
  for (size_t j = 0; j < kJoints; ++j)
    std::copy_n(frame.pose.local[j].data(), 9, numbers.begin() + 3 + 9 * static_cast<ptrdiff_t>(j));
  numbers[kPoseNumbers] = frame.confidence.value_or(kNone);
  numbers[kPoseNumbers + 1] = frame.filled ? 1 : 0;
  numbers[kPoseNumbers + 2] = frame.distance ? frame.distance->median : kNone;
  numbers[kPoseNumbers + 3] = frame.distance ? frame.distance->p95 : kNone;
  std::memcpy(record_.data(), numbers.data(), sizeof numbers);
  std::memcpy(record_.data() + sizeof numbers, frame.points.at(0).data(), points_ * sizeof(Point));
  if (const int code = write_all(file_, record_); code != 0) throw_refused(path_, "written", code);
  ++frames_;
}

void TrackJournal::keep(const std::string& state) {
  if (fdatasync(file_) != 0) throw_refused(path_, "written", errno);
  std::string all(reinterpret_cast<const char*>(&frames_), sizeof frames_);
  write_file_atomically(state_path_, all + state);
  state_ = state;
}

JournalFrame TrackJournal::read(int64_t frame) const {
  std::string record(record_.size(), '\0');
  for (size_t done = 0; done < record.size();) {
    const ssize_t got = pread(file_, record.data() + done, record.size() - done,
                              static_cast<off_t>(record.size()) * frame + static_cast<off_t>(done));
    if (got <= 0 && errno != EINTR) throw WorkError(path_ + ": cannot be read back");
    if (got > 0) done += static_cast<size_t>(got);
  }
  std::array<double, kNumbers> numbers;
  std::memcpy(numbers.data(), record.data(), sizeof numbers);
  JournalFrame out;
  out.pose.root = Eigen::Map<const Vec3>(numbers.data());
  for (size_t j = 0; j < kJoints; ++j)
    out.pose.local[j] = Eigen::Map<const Mat3>(&numbers[3 + 9 * j]);
  out.confidence = known(numbers[kPoseNumbers]);
  out.filled = numbers[kPoseNumbers + 1] != 0;
  if (const auto median = known(numbers[kPoseNumbers + 2]))
    out.distance = MiddleAndMost{*median, numbers[kPoseNumbers + 3]};
  out.points.resize(points_);
  std::memcpy(out.points[0].data(), record.data() + sizeof numbers, points_ * sizeof(Point));
  return out;
}

}  // namespace restage
