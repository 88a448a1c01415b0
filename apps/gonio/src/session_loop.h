#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "gonio/acquisition/reduction.h"
#include "gonio/acquisition/steering.h"
#include "gonio/console/console.h"
#include "gonio/instrument/instrument.h"
#include "gonio/quality/closed_loop.h"
#include "gonio/rig/kinematics.h"
#include "gonio/setup/rig_file.h"
#include "loop_settings.h"

namespace gonio::cli {

/// The closed loop of a session: replaces points that could not be measured, asks for more when the
/// material is unlike the training ones or a point does not fit the others, and with
/// LoopSettings::until_db stops when enough is foreseen, or goes on behind the plan until then.
///
/// Cost     Where it has to judge (with until_db after each point, else at the end of the plan) a
///          reduction of all that is measured and a fit.
/// Threads  As acquisition::Steering.
/// Errors   As SessionReader and acquisition::decisions(). What cannot be reduced or fitted is not
///          judged: the session goes on as planned.
class SessionLoop final : public acquisition::Steering {
 public:
  /// `instrument`, `rig` and, if not null, `console`, which is told of every decision, must outlive
  /// it.
  SessionLoop(LoopSettings settings, const instrument::Instrument& instrument, const RigFile& rig,
              std::filesystem::path archive, brdf::RadiometricScale scale, const Console* console);

  std::optional<acquisition::Decision> decide(const acquisition::SessionSoFar& now) override;

  /// By the last fit it made to decide.
  std::optional<acquisition::ExpectedSample> expected() const override;

  /// What a picture of the result is expected at, in dB, by the last fit it made to decide; nothing
  /// before the first.
  std::optional<double> expected_psnr_db() const { return expected_psnr_db_; }
  /// As asked for (LoopSettings::until_db).
  std::optional<double> wanted_psnr_db() const { return settings_.until_db; }

  /// The same from an archive at hand, also one of before (SessionReader::before_note()).
  std::optional<acquisition::Decision> decide(const acquisition::SessionSoFar& now,
                                              const acquisition::SessionReader& archive) const;

 private:
  struct Known;
  using Answer = std::optional<acquisition::Decision>;
  Answer replacement(const Known& known) const;
  Answer judged(const Known& known) const;
  Answer check_of_outlier(const Known& known, const quality::Prospect& seen) const;
  Answer towards_wish(const Known& known, const std::optional<quality::Prospect>& seen) const;
  Answer one_more(const Known& known, const std::vector<brdf::HalfDiff>& kept,
                  acquisition::AddedPoint added, std::string reason,
                  std::optional<double> expected_psnr_db) const;
  std::optional<quality::Prospect> look(const acquisition::SessionReader& archive) const;

  LoopSettings settings_;
  const instrument::Instrument& instrument_;
  const RigFile& rig_;
  std::filesystem::path archive_;
  brdf::RadiometricScale scale_;
  const Console* console_;
  rig::Inverse inverse_;
  quality::NextPose next_;
  mutable std::optional<double> expected_psnr_db_;
  mutable Eigen::MatrixXd coefficients_;  ///< k x 3, of the last fit; empty: none yet
};

/// Recomputes every decision of an archive from what it held at that time. One line for each that
/// comes out differently; empty: all are what the archive gives.
std::vector<std::string> replay_decisions(const SessionLoop& loop,
                                          const acquisition::SessionReader& archive,
                                          const rig::RigDescription& rig,
                                          const acquisition::MeasurementPlan& planned);

}  // namespace gonio::cli
