// A list of at most N values that lives where it is declared: no heap.
#pragma once

#include <cstddef>
#include <initializer_list>
#include <memory>
#include <utility>

#include "autograd/base/error.h"

namespace restage {

template <class T, size_t N>
class InlineVector {
 public:
  InlineVector() {}
  InlineVector(std::initializer_list<T> values) {
    for (const T& v : values) push_back(v);
  }
  InlineVector(const InlineVector& other) {
    for (const T& v : other) push_back(v);
  }
  InlineVector& operator=(const InlineVector& other) {
    if (this == &other) return *this;
    clear();
    for (const T& v : other) push_back(v);
    return *this;
  }
  ~InlineVector() { clear(); }

  /// Error beyond N values.
  void push_back(T value) {
    if (size_ == N) throw Error("a list of at most " + std::to_string(N) + " values is full");
    std::construct_at(data() + size_, std::move(value));
    ++size_;
  }
  void clear() {
    std::destroy_n(data(), size_);
    size_ = 0;
  }
  size_t size() const { return size_; }
  T* data() { return storage_.values; }
  const T* data() const { return storage_.values; }
  T* begin() { return data(); }
  T* end() { return data() + size_; }
  const T* begin() const { return data(); }
  const T* end() const { return data() + size_; }
  T& operator[](size_t i) { return data()[i]; }
  const T& operator[](size_t i) const { return data()[i]; }

 private:
  union Storage {
    Storage() {}
    ~Storage() {}
    T values[N];
  } storage_;
  size_t size_ = 0;
};

}  // namespace restage
