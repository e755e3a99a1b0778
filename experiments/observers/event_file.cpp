#include "experiments/observers/event_file.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <vector>

#include "autograd/base/error.h"
#include "autograd/base/host.h"
#include "experiments/observers/message.h"

namespace restage {
namespace {

constexpr int kBuckets = 30;

double now() {
  using namespace std::chrono;
  return duration<double>(system_clock::now().time_since_epoch()).count();
}

Message event(int64_t step) {
  Message out;
  return out.real(1, now()).number(2, static_cast<uint64_t>(step));
}

std::string summary(int64_t step, const Message& value) {
  return event(step).bytes(5, Message().bytes(1, value.text()).text()).text();
}

}  // namespace

uint32_t masked_crc32c(std::string_view bytes) {
  constexpr uint32_t kCastagnoli = 0x82f63b78u;
  static const CheckSum sum(kCastagnoli);
  const uint32_t crc = sum.of(bytes);
  return ((crc >> 15) | (crc << 17)) + 0xa282ead8u;
}

EventFile::EventFile(const std::string& folder, int64_t first_step) {
  path_ = folder + "/events.out.tfevents." + std::to_string(static_cast<int64_t>(now())) + "." +
          host_name() + "." + std::to_string(::getpid());
  file_.reset(std::fopen(path_.c_str(), "wb"));
  if (file_ == nullptr)
    throw WorkError(path_ + ": could not be made (" + std::strerror(errno) + ")");
  add(Message().real(1, now()).bytes(3, "brain.Event:2").text());
  constexpr uint64_t kStart = 1;
  add(event(first_step).bytes(7, Message().number(1, kStart).text()).text());
}

void EventFile::add(const std::string& event) {
  const std::string length = as_bytes<uint64_t>(event.size());
  const std::string record =
      length + as_bytes(masked_crc32c(length)) + event + as_bytes(masked_crc32c(event));
  if (std::fwrite(record.data(), 1, record.size(), file_.get()) != record.size())
    throw WorkError(path_ + ": could not be written (" + std::strerror(errno) + ")");
}

void EventFile::scalar(int64_t step, const std::string& tag, double value) {
  add(summary(step, Message().bytes(1, tag).single(2, static_cast<float>(value))));
}

void EventFile::histogram(int64_t step, const std::string& tag, std::span<const float> values) {
  double low = INFINITY, high = -INFINITY, sum = 0, squares = 0, count = 0;
  for (const float x : values) {
    if (!std::isfinite(x)) continue;
    const auto value = static_cast<double>(x);
    low = std::min(low, value), high = std::max(high, value);
    sum += value, squares += value * value, ++count;
  }
  if (count == 0) return;
  const double width = (high - low) / kBuckets;
  std::vector<double> limits(kBuckets), buckets(kBuckets, 0);
  for (int b = 0; b < kBuckets; ++b) limits[static_cast<size_t>(b)] = low + width * (b + 1);
  limits.back() = high;
  for (const float x : values) {
    if (!std::isfinite(x)) continue;
    const double at = width > 0 ? (static_cast<double>(x) - low) / width : 0;
    ++buckets[static_cast<size_t>(std::min<double>(at, kBuckets - 1))];
  }
  const Message histogram = Message()
                                .real(1, low)
                                .real(2, high)
                                .real(3, count)
                                .real(4, sum)
                                .real(5, squares)
                                .reals(6, limits)
                                .reals(7, buckets);
  add(summary(step, Message().bytes(1, tag).bytes(5, histogram.text())));
}

void EventFile::picture(int64_t step, const std::string& tag, int width, int height,
                        const std::string& png) {
  constexpr uint64_t kRgb = 3;
  const Message image = Message()
                            .number(1, static_cast<uint64_t>(height))
                            .number(2, static_cast<uint64_t>(width))
                            .number(3, kRgb)
                            .bytes(4, png);
  add(summary(step, Message().bytes(1, tag).bytes(4, image.text())));
}

void EventFile::flush() {
  if (std::fflush(file_.get()) != 0)
    throw WorkError(path_ + ": could not be written (" + std::strerror(errno) + ")");
}

}  // namespace restage
