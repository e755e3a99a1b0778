// Frames of a long sequence as a list, of which those used last are in memory and the others in a
// temporary file: five minutes of 13,380 vertices are 1.4 GB.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <deque>
#include <initializer_list>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

namespace restage {

/// A file without a name, in the system's temporary folder (TMPDIR), that goes away with its last
/// user. WorkError: it cannot be made or written (disk full).
class TemporaryFile {
 public:
  TemporaryFile();
  /// Adds bytes at the end; where they begin.
  int64_t append(const void* bytes, size_t size);
  void read(int64_t offset, void* bytes, size_t size) const;

 private:
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
  int64_t end_ = 0;
};

/// Used as a vector of frames. A reference to a frame is good while no more than kFrames others are
/// used. For one thread at a time.
template <class T>
class FrameStore {
 public:
  using Frame = std::vector<T>;
  using value_type = Frame;
  static constexpr size_t kFrames = 72;               // that are always in memory, and
  static constexpr size_t kBytes = size_t{32} << 20;  // as many as have this size together

  FrameStore() = default;
  FrameStore(std::initializer_list<Frame> frames) {
    for (const Frame& frame : frames) push_back(frame);
  }
  FrameStore(const std::vector<Frame>& frames) {
    for (const Frame& frame : frames) push_back(frame);
  }

  size_t size() const { return slots_.size(); }
  bool empty() const { return slots_.empty(); }
  void push_back(Frame frame) {
    slots_.push_back({std::move(frame)});
    hold(slots_.size() - 1);
  }
  template <class... Arguments>
  Frame& emplace_back(Arguments&&... arguments) {
    push_back(Frame(std::forward<Arguments>(arguments)...));
    return back();
  }
  void assign(size_t count, Frame frame) {
    *this = {};
    for (size_t i = 0; i < count; ++i) push_back(frame);
  }
  void clear() { *this = {}; }

  const Frame& operator[](size_t i) const { return use(i).frame; }
  /// What is done to the frame is kept.
  Frame& operator[](size_t i) {
    Slot& slot = use(i);
    slot.offset = -1;
    return slot.frame;
  }
  const Frame& at(size_t i) const {
    if (i >= size()) throw std::out_of_range("frame store");
    return (*this)[i];
  }
  const Frame& front() const { return (*this)[0]; }
  const Frame& back() const { return (*this)[size() - 1]; }
  Frame& back() { return (*this)[size() - 1]; }

  template <class Store>
  struct Iterator {
    using iterator_category = std::input_iterator_tag;
    using value_type = Frame;
    using difference_type = std::ptrdiff_t;
    using pointer = const Frame*;
    using reference = decltype((*std::declval<Store*>())[0]);
    Store* store;
    size_t i;
    decltype(auto) operator*() const { return (*store)[i]; }
    Iterator& operator++() {
      ++i;
      return *this;
    }
    Iterator operator++(int) { return {store, i++}; }
    bool operator!=(const Iterator& other) const { return i != other.i; }
    bool operator==(const Iterator& other) const { return i == other.i; }
  };
  auto begin() const { return Iterator<const FrameStore>{this, 0}; }
  auto end() const { return Iterator<const FrameStore>{this, size()}; }
  auto begin() { return Iterator<FrameStore>{this, 0}; }
  auto end() { return Iterator<FrameStore>{this, size()}; }

 private:
  struct Slot {
    Frame frame;
    int64_t offset = -1;  // in the file, if the frame is there as it is
    size_t count = 0;     // of the values there
    uint64_t used = 0;
    bool held = false;  // in memory
  };

  Slot& use(size_t i) const {
    Slot& slot = slots_[i];
    if (slot.held) {
      slot.used = ++clock_;
      return slot;
    }
    slot.frame.resize(slot.count);
    file_->read(slot.offset, slot.frame.data(), slot.count * sizeof(T));
    hold(i);
    return slot;
  }

  /// Frame i is in memory now; those used longest ago may have to leave for it.
  void hold(size_t i) const {
    slots_[i].used = ++clock_;
    slots_[i].held = true;
    held_.push_back(i);
    while (held_.size() > kFrames && bytes() > kBytes) {
      const auto oldest = std::min_element(held_.begin(), held_.end(), [&](size_t a, size_t b) {
        return slots_[a].used < slots_[b].used;
      });
      put_away(slots_[*oldest]);
      held_.erase(oldest);
    }
  }
  size_t bytes() const {
    size_t sum = 0;
    for (const size_t i : held_) sum += slots_[i].frame.size() * sizeof(T);
    return sum;
  }
  void put_away(Slot& slot) const {
    if (slot.offset < 0) {
      if (!file_) file_ = std::make_shared<TemporaryFile>();
      slot.count = slot.frame.size();
      slot.offset = file_->append(slot.frame.data(), slot.count * sizeof(T));
    }
    slot.frame = Frame();
    slot.held = false;
  }

  // What is where changes as frames are looked at. Copies share the file, in which nothing is ever
  // written over.
  mutable std::deque<Slot> slots_;
  mutable std::vector<size_t> held_;  // numbers of the frames in memory
  mutable uint64_t clock_ = 0;
  mutable std::shared_ptr<TemporaryFile> file_;
};

}  // namespace restage
