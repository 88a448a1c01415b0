#pragma once

#include <optional>
#include <string>

#include "command.h"
#include "gonio/acquisition/guarded_devices.h"
#include "gonio/opened_rig/opened_rig.h"
#include "gonio/setup/simulated_rig.h"

namespace gonio::cli {

/// What the commands that move a rig by hand share.
struct HandsOnOptions {
  std::string rig;
  std::string calibration;
  bool home = false;  ///< home all axes first
  bool json = false;
};

/// RIG, --calibration and --json; with `may_home` also --home.
void add_hands_on_options(const Command& command, HandsOnOptions& options, bool may_home);

/// A rig under a person's hands: the limits, keep-outs and re-arm rules of a session hold.
///
/// Lifetime  When it ends, axes stop and the shutter closes.
class HandsOn {
 public:
  /// Reads the rig file and opens its devices.
  HandsOn(Context& context, const HandsOnOptions& options, Parts parts);

  acquisition::GuardedDevices& guarded() { return *guarded_; }
  const acquisition::DeviceSet& devices() { return opened_->devices(); }
  const instrument::Instrument& instrument() const { return known_.constants; }
  const RigFile& file() const { return known_.file; }

  /// Homes, and says what axes tell of where they stood before; or takes over axes that know where
  /// they are; where they do not, says how to get there.
  void make_ready();
  /// Throws UsageError for a target that limits or keep-outs forbid.
  void require_allowed(const rig::Joints& target) const;
  /// Goes there; says so when it takes a while. Throws UsageError for a target that limits or
  /// keep-outs forbid, before anything moves.
  void move_to(const rig::Joints& target);
  /// Index of an axis by name. Throws UsageError, suggesting the nearest.
  std::size_t axis(const std::string& name) const;
  /// Prints where the axes stand.
  void print_joints() const;
  /// The end of every command: stops all, closes the shutter and makes sure of it. Throws
  /// devices::DeviceError; nothing can be done with it afterwards.
  void finish();

 private:
  void home();

  Context& context_;
  HandsOnOptions options_;
  KnownRig known_;
  std::unique_ptr<OpenedRig> opened_;
  std::optional<acquisition::GuardedDevices> guarded_;
};

}  // namespace gonio::cli
