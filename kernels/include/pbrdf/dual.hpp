// Numbers that carry their derivatives by none, one or two parameters: what is written once as a formula gives its
// values alone (Dual<T, 0>) or values and gradient, without a second text to keep in step.
#pragma once

#include <cmath>

namespace pbrdf {

template <class T, int n>
struct Slopes;

// Members by name: an array in a struct would keep a loop over lanes from being vectorised.
template <class T>
struct Slopes<T, 0> {};

template <class T>
struct Slopes<T, 1> {
  T first;
};

template <class T>
struct Slopes<T, 2> {
  T first, second;
};

template <class T>
[[gnu::always_inline]] inline Slopes<T, 0> combined(T, Slopes<T, 0>, T, Slopes<T, 0>) {
  return {};
}

template <class T>
[[gnu::always_inline]] inline Slopes<T, 1> combined(T s, Slopes<T, 1> x, T t, Slopes<T, 1> y) {
  return {s * x.first + t * y.first};
}

template <class T>
[[gnu::always_inline]] inline Slopes<T, 2> combined(T s, Slopes<T, 2> x, T t, Slopes<T, 2> y) {
  return {s * x.first + t * y.first, s * x.second + t * y.second};
}

template <class T>
[[gnu::always_inline]] inline Slopes<T, 0> scaled(T, Slopes<T, 0>) {
  return {};
}

template <class T>
[[gnu::always_inline]] inline Slopes<T, 1> scaled(T s, Slopes<T, 1> x) {
  return {s * x.first};
}

template <class T>
[[gnu::always_inline]] inline Slopes<T, 2> scaled(T s, Slopes<T, 2> x) {
  return {s * x.first, s * x.second};
}

template <class T>
[[gnu::always_inline]] inline Slopes<T, 0> chosen(bool, Slopes<T, 0>, Slopes<T, 0>) {
  return {};
}

template <class T>
[[gnu::always_inline]] inline Slopes<T, 1> chosen(bool first, Slopes<T, 1> x, Slopes<T, 1> y) {
  return {first ? x.first : y.first};
}

template <class T>
[[gnu::always_inline]] inline Slopes<T, 2> chosen(bool first, Slopes<T, 2> x, Slopes<T, 2> y) {
  return {first ? x.first : y.first, first ? x.second : y.second};
}

template <class T, int n>
struct Dual {
  T value;
  Slopes<T, n> slope;

  [[gnu::always_inline]] friend inline Dual operator-(Dual x) { return {-x.value, scaled(T(-1), x.slope)}; }
  [[gnu::always_inline]] friend inline Dual operator+(Dual x, Dual y) {
    return {x.value + y.value, combined(T(1), x.slope, T(1), y.slope)};
  }
  [[gnu::always_inline]] friend inline Dual operator-(Dual x, Dual y) {
    return {x.value - y.value, combined(T(1), x.slope, T(-1), y.slope)};
  }
  [[gnu::always_inline]] friend inline Dual operator*(Dual x, Dual y) {
    return {x.value * y.value, combined(y.value, x.slope, x.value, y.slope)};
  }
  [[gnu::always_inline]] friend inline Dual operator+(Dual x, T c) { return {x.value + c, x.slope}; }
  [[gnu::always_inline]] friend inline Dual operator+(T c, Dual x) { return {c + x.value, x.slope}; }
  [[gnu::always_inline]] friend inline Dual operator-(Dual x, T c) { return {x.value - c, x.slope}; }
  [[gnu::always_inline]] friend inline Dual operator-(T c, Dual x) { return {c - x.value, scaled(T(-1), x.slope)}; }
  [[gnu::always_inline]] friend inline Dual operator*(Dual x, T c) { return {x.value * c, scaled(c, x.slope)}; }
  [[gnu::always_inline]] friend inline Dual operator*(T c, Dual x) { return {c * x.value, scaled(c, x.slope)}; }
};

template <class T>
[[gnu::always_inline]] inline T square(T x) {
  return x * x;
}

template <class T, int n>
[[gnu::always_inline]] inline Dual<T, n> square(Dual<T, n> x) {
  return {x.value * x.value, scaled(T(2) * x.value, x.slope)};
}

template <class T, int n>
[[gnu::always_inline]] inline Dual<T, n> inverse(Dual<T, n> x) {
  const T value = T(1) / x.value;
  return {value, scaled(-value * value, x.slope)};
}

template <class T>
[[gnu::always_inline]] inline Dual<T, 0> square_root(Dual<T, 0> x) {
  return {std::sqrt(x.value), {}};
}

template <class T, int n>
[[gnu::always_inline]] inline Dual<T, n> square_root(Dual<T, n> x) {
  const T value = std::sqrt(x.value);
  return {value, scaled(T(0.5) / value, x.slope)};
}

template <class T, int n>
[[gnu::always_inline]] inline Dual<T, n> chosen(bool first, Dual<T, n> x, Dual<T, n> y) {
  return {first ? x.value : y.value, chosen(first, x.slope, y.slope)};
}

}  // namespace pbrdf
