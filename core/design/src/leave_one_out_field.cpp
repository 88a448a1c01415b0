#include "leave_one_out_field.h"

#include <cblas.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "gonio/design/criteria.h"

namespace gonio::design {
namespace {

constexpr std::size_t kLanes = 64;  // candidates whose products stay in the first-level caches
constexpr Eigen::Index kGroup = 8;  // materials multiplied before a logarithm is taken
constexpr std::array<std::array<int, 2>, 6> kPairs = {
    {{0, 0}, {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}}};

using Lane = std::array<float, kLanes>;

/// sum over lanes: error[i] = trace of B S B with B = (I - H)^-1, all symmetric 3 x 3.
void material_errors(const float* blocks, const float* v, const float* q, const Lane& inverse_d,
                     const Lane& bend, Lane& error) {
  for (std::size_t i = 0; i < kLanes; ++i) {
    const float v0 = v[i], v1 = v[kLanes + i], v2 = v[2 * kLanes + i];
    const float q0 = q[i], q1 = q[kLanes + i], q2 = q[2 * kLanes + i];
    const float t = inverse_d[i];
    const float c = bend[i];  // (b.K b) / d^2
    const float w0 = t * v0, w1 = t * v1, w2 = t * v2;
    // I - H', upper triangle.
    const float a00 = blocks[0] - w0 * v0, a01 = blocks[1] - w0 * v1, a02 = blocks[2] - w0 * v2;
    const float a11 = blocks[3] - w1 * v1, a12 = blocks[4] - w1 * v2, a22 = blocks[5] - w2 * v2;
    const float s00 = blocks[6] - 2.0F * w0 * q0 + c * v0 * v0;
    const float s01 = blocks[7] - (w0 * q1 + w1 * q0) + c * v0 * v1;
    const float s02 = blocks[8] - (w0 * q2 + w2 * q0) + c * v0 * v2;
    const float s11 = blocks[9] - 2.0F * w1 * q1 + c * v1 * v1;
    const float s12 = blocks[10] - (w1 * q2 + w2 * q1) + c * v1 * v2;
    const float s22 = blocks[11] - 2.0F * w2 * q2 + c * v2 * v2;
    // The adjugate, then trace(B^2 S).
    const float b00 = a11 * a22 - a12 * a12, b01 = a02 * a12 - a01 * a22;
    const float b02 = a01 * a12 - a02 * a11, b11 = a00 * a22 - a02 * a02;
    const float b12 = a01 * a02 - a00 * a12, b22 = a00 * a11 - a01 * a01;
    const float determinant = a00 * b00 + a01 * b01 + a02 * b02;
    const float p00 = b00 * b00 + b01 * b01 + b02 * b02;
    const float p01 = b00 * b01 + b01 * b11 + b02 * b12;
    const float p02 = b00 * b02 + b01 * b12 + b02 * b22;
    const float p11 = b01 * b01 + b11 * b11 + b12 * b12;
    const float p12 = b01 * b02 + b11 * b12 + b12 * b22;
    const float p22 = b02 * b02 + b12 * b12 + b22 * b22;
    const float trace =
        p00 * s00 + p11 * s11 + p22 * s22 + 2.0F * (p01 * s01 + p02 * s02 + p12 * s12);
    error[i] = trace / (3.0F * determinant * determinant);
  }
}

}  // namespace

LeaveOneOutField::LeaveOneOutField(const Eigen::MatrixXd& kept, const Eigen::VectorXd& noise_share,
                                   const Eigen::MatrixXd& left_vectors,
                                   const Eigen::MatrixXd& importance, double eta, double floor)
    : k_(left_vectors.cols()),
      materials_(left_vectors.rows() / 3),
      kept_(kept.rows()),
      eta_(eta),
      floor_(floor),
      noise_unit_(1.0 / (eta * static_cast<double>(left_vectors.rows()))) {
  if ((noise_share.array() > 0.0).any()) kept_noise_share_ = noise_share.cast<float>();
  const Eigen::Index m = left_vectors.rows();
  const Eigen::MatrixXd open =
      kept_ == 0 ? Eigen::MatrixXd(Eigen::MatrixXd::Identity(k_, k_)) : open_share(kept, eta);
  const Eigen::MatrixXd unseen = left_vectors * open;
  const Eigen::MatrixXd importance_open = importance * open;
  const Eigen::MatrixXd moves = kept * open;
  products_.resize(2 * m + 2 * kept_ + 2 * k_, k_);
  products_.topRows(m) = unseen.cast<float>();
  products_.middleRows(m, m) = (unseen * importance_open).cast<float>();
  products_.middleRows(2 * m, kept_) = moves.cast<float>();
  products_.middleRows(2 * m + kept_, kept_) = (moves * importance_open).cast<float>();
  products_.middleRows(2 * m + 2 * kept_, k_) = open.cast<float>();
  products_.bottomRows(k_) = (open * importance_open).cast<float>();
  noise_ = noise_unit_ *
           ((moves * importance).cwiseProduct(moves).rowwise().sum().array() * noise_share.array())
               .sum();
  blocks_.resize(static_cast<std::size_t>(12 * materials_));
  const Eigen::MatrixXd weighted = unseen * importance;
  for (Eigen::Index g = 0; g < materials_; ++g) {
    const auto u = left_vectors.middleRows<3>(3 * g);
    const auto e = unseen.middleRows<3>(3 * g);
    const Eigen::Matrix3d rest =
        Eigen::Matrix3d::Identity() - u * u.transpose() + e * u.transpose();
    const Eigen::Matrix3d error = weighted.middleRows<3>(3 * g) * e.transpose();
    float* out = blocks_.data() + 12 * g;
    for (std::size_t i = 0; i < kPairs.size(); ++i) {
      out[i] = static_cast<float>(rest(kPairs[i][0], kPairs[i][1]));
      out[6 + i] = static_cast<float>(error(kPairs[i][0], kPairs[i][1]));
    }
  }
}

void LeaveOneOutField::values(const float* candidates, const float* noise_share, std::size_t count,
                              double* out) const {
  const auto k = static_cast<std::size_t>(k_);
  const Eigen::Index m = 3 * materials_;
  const Eigen::Index total = products_.rows();
  std::vector<float> padded(kLanes * k);
  std::vector<float> product(static_cast<std::size_t>(total) * kLanes);
  const auto line = [&](Eigen::Index row) {
    return product.data() + static_cast<std::size_t>(row) * kLanes;
  };
  for (std::size_t from = 0; from < count; from += kLanes) {
    const std::size_t width = std::min(kLanes, count - from);
    std::copy_n(candidates + from * k, width * k, padded.begin());
    // What is left over repeats the last: harmless numbers in unused lanes.
    for (std::size_t i = width; i < kLanes; ++i) {
      std::copy_n(candidates + (from + width - 1) * k, k,
                  padded.begin() + static_cast<std::ptrdiff_t>(i * k));
    }
    cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasTrans, static_cast<int>(total),
                static_cast<int>(kLanes), static_cast<int>(k), 1.0F, products_.data(),
                static_cast<int>(k), padded.data(), static_cast<int>(k), 0.0F, product.data(),
                static_cast<int>(kLanes));
    std::array<double, kLanes> a_b{};
    std::array<double, kLanes> b_importance_b{};
    for (Eigen::Index j = 0; j < k_; ++j) {
      const float* open = line(2 * m + 2 * kept_ + j);
      const float* weighted = line(2 * m + 2 * kept_ + k_ + j);
      for (std::size_t i = 0; i < kLanes; ++i) {
        const float a = padded[i * k + static_cast<std::size_t>(j)];
        a_b[i] += static_cast<double>(a * open[i]);
        b_importance_b[i] += static_cast<double>(a * weighted[i]);
      }
    }
    Lane inverse_d;
    Lane bend;
    std::array<double, kLanes> noise;
    for (std::size_t i = 0; i < kLanes; ++i) {
      const double d = 1.0 / (eta_ + a_b[i]);
      inverse_d[i] = static_cast<float>(d);
      bend[i] = static_cast<float>(b_importance_b[i] * d * d);
      // The candidate's own part: its row times M' is b eta / d.
      const float own = noise_share == nullptr ? 0.0F : noise_share[from + std::min(i, width - 1)];
      noise[i] =
          noise_ + noise_unit_ * static_cast<double>(own) * eta_ * eta_ * d * d * b_importance_b[i];
    }
    if (kept_noise_share_.size() != 0) {
      for (Eigen::Index j = 0; j < kept_; ++j) {
        const double share = noise_unit_ * static_cast<double>(kept_noise_share_[j]);
        const float* moved = line(2 * m + j);
        const float* weighted = line(2 * m + kept_ + j);
        for (std::size_t i = 0; i < kLanes; ++i) {
          const double x = static_cast<double>(moved[i]);
          noise[i] += share * (x * x * static_cast<double>(bend[i]) -
                               2.0 * x * static_cast<double>(weighted[i] * inverse_d[i]));
        }
      }
    }
    std::array<double, kLanes> sum{};
    std::array<double, kLanes> group;
    group.fill(1.0);
    Lane error;
    for (Eigen::Index g = 0; g < materials_; ++g) {
      material_errors(blocks_.data() + 12 * g, line(3 * g), line(m + 3 * g), inverse_d, bend,
                      error);
      for (std::size_t i = 0; i < kLanes; ++i) {
        // Rounding may leave a hair below zero.
        group[i] *=
            static_cast<double>(std::max(error[i], 0.0F)) + std::max(noise[i], 0.0) + floor_;
      }
      if ((g + 1) % kGroup == 0 || g + 1 == materials_) {
        for (std::size_t i = 0; i < kLanes; ++i) {
          sum[i] += std::log10(group[i]);
          group[i] = 1.0;
        }
      }
    }
    for (std::size_t i = 0; i < width; ++i)
      out[from + i] = sum[i] / static_cast<double>(materials_);
  }
}

}  // namespace gonio::design
