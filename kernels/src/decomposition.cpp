#include "pbrdf/decomposition.hpp"

#include <Eigen/SVD>
#include <cmath>
#include <limits>

#include "pbrdf/isa.hpp"
#include "pbrdf/mueller_lanes.hpp"

namespace pbrdf {
namespace {

// Below this, waking threads costs more than they save.
constexpr std::int64_t worth_threads = 1 << 14;
// Handed out as threads come for them, for a core may be busy with something else.
constexpr std::int64_t blocks_at_once = 256;

// Newton's rounds until the polar factor is orthogonal to rounding, whatever the matrix.
template <typename T>
constexpr int newton_rounds = sizeof(T) == 8 ? 8 : 6;

template <typename T>
constexpr T epsilon = std::numeric_limits<T>::epsilon();

// A ratio of the middle singular value to the largest that Newton's iteration bears without a loss of digits.
template <typename T>
constexpr T flattest = sizeof(T) == 8 ? T(1e-4) : T(3e-3);

// What the vectorised loops find of a lane; all but the regular ones are decomposed one by one.
enum class Lane { regular, steep, polariser, undefined };

template <typename T>
struct Vector3 {
  T x, y, z;
};

template <typename T>
[[gnu::always_inline]] inline T dot(const Vector3<T>& a, const Vector3<T>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

template <typename T>
[[gnu::always_inline]] inline Vector3<T> cross(const Vector3<T>& a, const Vector3<T>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

template <typename T>
[[gnu::always_inline]] inline Vector3<T> combined(T s, const Vector3<T>& a, T t, const Vector3<T>& b) {
  return {s * a.x + t * b.x, s * a.y + t * b.y, s * a.z + t * b.z};
}

// Rows of a 3 x 3 matrix.
template <typename T>
struct Matrix3 {
  Vector3<T> x, y, z;
};

template <typename T>
[[gnu::always_inline]] inline T squares(const Matrix3<T>& a) {
  return dot(a.x, a.x) + dot(a.y, a.y) + dot(a.z, a.z);
}

// det A times the inverse transpose.
template <typename T>
[[gnu::always_inline]] inline Matrix3<T> cofactors(const Matrix3<T>& a) {
  return {cross(a.y, a.z), cross(a.z, a.x), cross(a.x, a.y)};
}

template <typename T>
[[gnu::always_inline]] inline Matrix3<T> combined(T s, const Matrix3<T>& a, T t, const Matrix3<T>& b) {
  return {combined(s, a.x, t, b.x), combined(s, a.y, t, b.y), combined(s, a.z, t, b.z)};
}

template <typename T>
[[gnu::always_inline]] inline Vector3<T> applied(const Matrix3<T>& a, const Vector3<T>& v) {
  return {dot(a.x, v), dot(a.y, v), dot(a.z, v)};
}

template <typename T>
struct Matrix3Lanes {
  alignas(64) T element[9][lanes];
};

template <typename T>
[[gnu::always_inline]] inline Matrix3<T> read(const Matrix3Lanes<T>& a, int l) {
  const T(&e)[9][lanes] = a.element;
  return {{e[0][l], e[1][l], e[2][l]}, {e[3][l], e[4][l], e[5][l]}, {e[6][l], e[7][l], e[8][l]}};
}

template <typename T>
[[gnu::always_inline]] inline void write(Matrix3Lanes<T>& a, int l, const Matrix3<T>& m) {
  T(&e)[9][lanes] = a.element;
  e[0][l] = m.x.x;
  e[1][l] = m.x.y;
  e[2][l] = m.x.z;
  e[3][l] = m.y.x;
  e[4][l] = m.y.y;
  e[5][l] = m.y.z;
  e[6][l] = m.z.x;
  e[7][l] = m.z.y;
  e[8][l] = m.z.z;
}

// First row, first column and the rest of a Mueller matrix.
template <typename T>
[[gnu::always_inline]] inline void write_mueller(MuellerLanes<T>& lane, int l, T m00, const Vector3<T>& row,
                                                 const Vector3<T>& column, const Matrix3<T>& m) {
  T(&e)[16][lanes] = lane.element;
  e[0][l] = m00;
  e[1][l] = row.x;
  e[2][l] = row.y;
  e[3][l] = row.z;
  e[4][l] = column.x;
  e[5][l] = m.x.x;
  e[6][l] = m.x.y;
  e[7][l] = m.x.z;
  e[8][l] = column.y;
  e[9][l] = m.y.x;
  e[10][l] = m.y.y;
  e[11][l] = m.y.z;
  e[12][l] = column.z;
  e[13][l] = m.z.x;
  e[14][l] = m.z.y;
  e[15][l] = m.z.z;
}

template <typename T>
struct Blocks {
  MuellerLanes<T> mueller, depolariser, retarder, diattenuator;
  Matrix3Lanes<T> prime;   // m', of M' = M M_D^-1
  Matrix3Lanes<T> factor;  // on its way to the retarder's rotation
  alignas(64) T polarizance[3][lanes];
  alignas(64) T lane[lanes];  // a Lane
};

// M_D, M' and the start of Newton's iteration.
template <typename T>
[[gnu::always_inline]] inline void divide_by_diattenuator(Blocks<T>& b) {
  const T(&e)[16][lanes] = b.mueller.element;
#pragma GCC ivdep
  for (int l = 0; l < lanes; ++l) {
    const T m00 = e[0][l], unit = 1 / m00;
    const Vector3<T> d{e[1][l] * unit, e[2][l] * unit, e[3][l] * unit};
    const Vector3<T> p{e[4][l] * unit, e[8][l] * unit, e[12][l] * unit};
    const Matrix3<T> m{{e[5][l] * unit, e[6][l] * unit, e[7][l] * unit},
                       {e[9][l] * unit, e[10][l] * unit, e[11][l] * unit},
                       {e[13][l] * unit, e[14][l] * unit, e[15][l] * unit}};
    const T a_squared = 1 - dot(d, d);
    const T a = std::sqrt(a_squared > 0 ? a_squared : T(0));

    // m_D = a I + (1 - a) d d^T / |d|^2 without the division by a small |d|
    const T along = m00 / (1 + a), straight = m00 * a;
    const Vector3<T> dx{along * d.x * d.x + straight, along * d.x * d.y, along * d.x * d.z};
    const Vector3<T> dy{dx.y, along * d.y * d.y + straight, along * d.y * d.z};
    const Vector3<T> dz{dx.z, dy.z, along * d.z * d.z + straight};
    const Vector3<T> scaled{e[1][l], e[2][l], e[3][l]};
    write_mueller(b.diattenuator, l, m00, scaled, scaled, Matrix3<T>{dx, dy, dz});

    const T inverse = 1 / a_squared;
    const Vector3<T> q = combined(inverse, p, -inverse, applied(m, d));
    b.polarizance[0][l] = q.x;
    b.polarizance[1][l] = q.y;
    b.polarizance[2][l] = q.z;
    // (m - (P + a q) D^T / (1 + a)) / a
    const T over = 1 / a, shared = -1 / (a + a_squared);
    const Vector3<T> s = combined(shared, p, shared * a, q);
    const Matrix3<T> prime{combined(over, m.x, s.x, d), combined(over, m.y, s.y, d), combined(over, m.z, s.z, d)};
    write(b.prime, l, prime);

    // The rotation is that of +-m' with a positive determinant. Cofactors share its singular vectors: adding them
    // changes nothing but that the smallest singular value is away from zero.
    const Matrix3<T> c = cofactors(prime);
    const T norm = std::sqrt(squares(prime)), c_norm = std::sqrt(squares(c));
    const T determinant = dot(prime.x, c.x);
    write(b.factor, l, combined((determinant < 0 ? T(-1) : T(1)) / norm, prime, T(0.5) / c_norm, c));

    // Not where the determinant's sign, or much of the cofactors, is a matter of rounding.
    const T rounding = 8 * epsilon<T> * inverse;
    const T uncertain = rounding * c_norm + 16 * epsilon<T> * norm * norm * norm;
    const bool steep = (std::fabs(determinant) <= uncertain) | (c_norm <= flattest<T> * norm * norm);
    const bool polariser = a_squared < 64 * epsilon<T>;
    T zero = 0;
    for (int k = 0; k < 16; ++k) zero += 0 * e[k][l];
    const bool defined = (m00 > 0) & (a_squared > -64 * epsilon<T>)&(zero == 0);
    const T regular = steep ? T(Lane::steep) : T(Lane::regular);
    b.lane[l] = !defined ? T(Lane::undefined) : polariser ? T(Lane::polariser) : regular;
  }
}

// Newton's iteration X <- (zeta X + X^-T / zeta) / 2, scaled by zeta^2 = |X^-1| / |X|.
template <typename T>
[[gnu::always_inline]] inline void newton_round(Matrix3Lanes<T>& factor) {
#pragma GCC ivdep
  for (int l = 0; l < lanes; ++l) {
    const Matrix3<T> x = read(factor, l);
    const Matrix3<T> c = cofactors(x);
    const T inverse = 1 / dot(x.x, c.x);
    const T zeta = std::sqrt(std::sqrt(squares(c) / squares(x)) * inverse);
    write(factor, l, combined(T(0.5) * zeta, x, T(0.5) * inverse / zeta, c));
  }
}

// m_depolariser = m' R^T, symmetric but for rounding.
template <typename T>
[[gnu::always_inline]] inline Matrix3<T> depolarising_part(const Matrix3<T>& prime, const Matrix3<T>& r) {
  const T xy = T(0.5) * (dot(prime.x, r.y) + dot(prime.y, r.x));
  const T xz = T(0.5) * (dot(prime.x, r.z) + dot(prime.z, r.x));
  const T yz = T(0.5) * (dot(prime.y, r.z) + dot(prime.z, r.y));
  return {{dot(prime.x, r.x), xy, xz}, {xy, dot(prime.y, r.y), yz}, {xz, yz, dot(prime.z, r.z)}};
}

template <typename T>
[[gnu::always_inline]] inline Vector3<T> polarizance(const Blocks<T>& b, int l) {
  return {b.polarizance[0][l], b.polarizance[1][l], b.polarizance[2][l]};
}

template <typename T>
[[gnu::always_inline]] inline void write_factors(Blocks<T>& b) {
  const Vector3<T> none{0, 0, 0};
#pragma GCC ivdep
  for (int l = 0; l < lanes; ++l) {
    const Matrix3<T> r = read(b.factor, l);
    write_mueller(b.retarder, l, T(1), none, none, r);
    write_mueller(b.depolariser, l, T(1), none, polarizance(b, l), depolarising_part(read(b.prime, l), r));
  }
}

template <typename T>
Vector3<T> direction(const Vector3<T>& v) {
  const T length = std::sqrt(dot(v, v));
  return length > 0 ? combined(1 / length, v, T(0), v) : v;
}

template <typename T>
Vector3<T> any_across(const Vector3<T>& v) {
  const T x = std::fabs(v.x), y = std::fabs(v.y), z = std::fabs(v.z);
  const Vector3<T> other = x <= y && x <= z ? Vector3<T>{1, 0, 0} : y <= z ? Vector3<T>{0, 1, 0} : Vector3<T>{0, 0, 1};
  return direction(cross(v, other));
}

// The rotation by the smallest angle that takes one direction to another; identity if one of them is zero.
template <typename T>
Matrix3<T> smallest_rotation(const Vector3<T>& from, const Vector3<T>& to) {
  const Matrix3<T> identity{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const Vector3<T> u = direction(from), v = direction(to);
  if (!(dot(u, u) > 0 && dot(v, v) > 0)) return identity;
  const T c = dot(u, v);
  const Vector3<T> k = cross(u, v);
  const bool opposite = c < 0 && dot(k, k) < 16 * epsilon<T> * epsilon<T>;
  const Vector3<T> n = opposite ? any_across(u) : direction(k);
  const T t = 1 - c;
  return {{c + t * n.x * n.x, t * n.x * n.y - k.z, t * n.x * n.z + k.y},
          {t * n.x * n.y + k.z, c + t * n.y * n.y, t * n.y * n.z - k.x},
          {t * n.x * n.z - k.y, t * n.y * n.z + k.x, c + t * n.z * n.z}};
}

inline Vector3<double> column(const Eigen::Matrix3d& a, int k) { return {a(0, k), a(1, k), a(2, k)}; }

// s u v^T + t w x^T
template <typename T>
Matrix3<T> dyads(T s, const Vector3<T>& u, const Vector3<T>& v, T t, const Vector3<T>& w, const Vector3<T>& x) {
  return {combined(s * u.x, v, t * w.x, x), combined(s * u.y, v, t * w.y, x), combined(s * u.z, v, t * w.z, x)};
}

// The rotation of an m' whose smaller singular values may be zero; rounding: the least one that is not.
inline Matrix3<double> careful_rotation(const Matrix3<double>& prime, double rounding, Guard& guard) {
  const Vector3<double> zero{0, 0, 0};
  guard = Guard::rank_one;
  if (std::sqrt(squares(prime)) <= rounding) return smallest_rotation(zero, zero);
  Eigen::Matrix3d a;
  a << prime.x.x, prime.x.y, prime.x.z, prime.y.x, prime.y.y, prime.y.z, prime.z.x, prime.z.y, prime.z.z;
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(a, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Vector3<double> u = column(svd.matrixU(), 0), v = column(svd.matrixV(), 0);
  if (svd.singularValues()[1] <= rounding) return smallest_rotation(v, u);
  const Vector3<double> w = column(svd.matrixU(), 1), x = column(svd.matrixV(), 1);
  const Vector3<double> last_u = cross(u, w), last_v = cross(v, x);
  const double last = dot(last_u, applied(prime, last_v));
  guard = std::fabs(last) > rounding ? Guard::none : Guard::singular;
  const double sign = last < -rounding ? -1 : 1;
  return combined(1.0, dyads(sign, u, v, sign, w, x), 1.0, dyads(1.0, last_u, last_v, 0.0, u, v));
}

template <typename To, typename From>
Vector3<To> converted(const Vector3<From>& v) {
  return {static_cast<To>(v.x), static_cast<To>(v.y), static_cast<To>(v.z)};
}

template <typename To, typename From>
Matrix3<To> converted(const Matrix3<From>& a) {
  return {converted<To>(a.x), converted<To>(a.y), converted<To>(a.z)};
}

// A lane that is not regular, outside the vectorised loops.
template <typename T>
Guard guard_lane(Blocks<T>& b, int l) {
  const T(&e)[16][lanes] = b.mueller.element;
  const Vector3<T> none{0, 0, 0};
  const T unit = 1 / e[0][l];
  const Vector3<T> d{e[1][l] * unit, e[2][l] * unit, e[3][l] * unit};
  if (b.lane[l] == T(Lane::steep)) {
    Guard guard;
    const Matrix3<T> prime = read(b.prime, l);
    const double rounding = 8 * epsilon<T> / (1 - dot(d, d));
    const Matrix3<T> r = converted<T>(careful_rotation(converted<double>(prime), rounding, guard));
    write_mueller(b.retarder, l, T(1), none, none, r);
    write_mueller(b.depolariser, l, T(1), none, polarizance(b, l), depolarising_part(prime, r));
    return guard;
  }
  if (b.lane[l] == T(Lane::polariser)) {
    const Vector3<T> p{e[4][l] * unit, e[8][l] * unit, e[12][l] * unit};
    const T length = std::sqrt(dot(p, p)), along = e[0][l] / dot(d, d);
    const Vector3<T> row{e[1][l], e[2][l], e[3][l]};
    write_mueller(b.diattenuator, l, e[0][l], row, row, dyads(along, d, d, T(0), d, d));
    write_mueller(b.retarder, l, T(1), none, none, smallest_rotation(d, p));
    write_mueller(b.depolariser, l, T(1), none, none, Matrix3<T>{{length, 0, 0}, {0, length, 0}, {0, 0, length}});
    return Guard::polariser;
  }
  const T nan = std::numeric_limits<T>::quiet_NaN();
  const Vector3<T> row{nan, nan, nan};
  for (MuellerLanes<T>* factor : {&b.depolariser, &b.retarder, &b.diattenuator})
    write_mueller(*factor, l, nan, row, row, Matrix3<T>{row, row, row});
  return Guard::undefined;
}

template <typename T>
[[gnu::always_inline]] inline void decompose_block(const T* mueller, int count, T* depolariser, T* retarder,
                                                   T* diattenuator, Guard* guard) {
  Blocks<T> b;
  load_lanes(mueller, count, b.mueller);
  divide_by_diattenuator(b);
  for (int round = 0; round < newton_rounds<T>; ++round) newton_round(b.factor);
  write_factors(b);
  for (int l = 0; l < count; ++l) {
    const bool regular = b.lane[l] == T(Lane::regular);
    guard[l] = regular ? Guard::none : guard_lane(b, l);
  }
  store_lanes(b.depolariser, count, depolariser);
  store_lanes(b.retarder, count, retarder);
  store_lanes(b.diattenuator, count, diattenuator);
}

}  // namespace

template <typename T>
void lu_chipman(const T* mueller, std::int64_t pixels, const LuChipmanFactors<T>& factors) {
#pragma omp parallel for schedule(dynamic, blocks_at_once) if (pixels >= worth_threads)
  for (std::int64_t block = 0; block < lane_blocks(pixels); ++block) {
    const std::int64_t pixel = lanes * block;
    in_version([&]() __attribute__((always_inline)) {
      decompose_block(mueller + 16 * pixel, lanes_in(block, pixels), factors.depolariser + 16 * pixel,
                      factors.retarder + 16 * pixel, factors.diattenuator + 16 * pixel, factors.guard + pixel);
    });
  }
}

template void lu_chipman(const float*, std::int64_t, const LuChipmanFactors<float>&);
template void lu_chipman(const double*, std::int64_t, const LuChipmanFactors<double>&);

}  // namespace pbrdf
