#include "monitoring.h"

#include <fmt/format.h>

#include <system_error>

#include "gonio/basis/basis_file.h"
#include "samples_input.h"

namespace gonio::cli {
namespace {

constexpr std::chrono::milliseconds kPatienceOfPages{2500};  // they ask once a second

std::unique_ptr<monitor::GrowingReconstruction> reconstruction_of(const MonitorOptions& options,
                                                                  const SessionSetup& session) {
  if (options.basis.empty()) return nullptr;
  auto basis = std::make_shared<const basis::Basis>(basis::read_basis(options.basis));
  require_scale_of(*basis, options.basis, session.material.scale, "this session");
  return std::make_unique<monitor::GrowingReconstruction>(monitor::GrowingReconstruction::Source{
      session.archive, session.instrument, session.rig.reduction, session.material.scale, basis});
}

monitor::SessionFacts facts_of(const SessionSetup& session) {
  monitor::SessionFacts facts;
  facts.archive = session.archive.string();
  facts.rig = session.rig.rig.name;
  facts.sample_id = session.labels.sample_id;
  facts.simulated = session.simulated;
  facts.white_in_frame = session.rig.session.white == acquisition::WhitePlacement::in_frame;
  for (const acquisition::PlannedPoint& point : session.plan.points) {
    facts.directions.push_back(point.direction);
  }
  return facts;
}

}  // namespace

void add_page_options(const Command& command, MonitorOptions& options, const std::string& what) {
  command.port("--monitor", options.port, kMonitorPort,
               fmt::format("{} (default port {}; 0: any that is free)", what, kMonitorPort));
  command.text("--monitor-address", options.address,
               "IP address to serve it on (default: 127.0.0.1, this machine only)");
}

void add_monitor_options(const Command& command, MonitorOptions& options) {
  add_page_options(command, options, "Serve a live page");
  command.text("--basis", options.basis, "With --monitor: show the reconstruction as it grows");
}

monitor::HttpAddress monitor_address(const Console& console, const MonitorOptions& options) {
  monitor::HttpAddress address;
  address.port = options.port.value_or(kMonitorPort);
  if (options.address.empty()) return address;
  address.address = options.address;
  try {
    if (!address.is_loopback()) {
      console.warn(
          fmt::format("the live page on {} can be read by everyone who reaches this "
                      "machine, and the token goes over the network in the clear",
                      address.address));
    }
  } catch (const std::invalid_argument& error) {
    throw UsageError(std::string("--monitor-address: ") + error.what());
  }
  return address;
}

void listening(const std::function<void()>& listen) {
  try {
    listen();
  } catch (const std::system_error& error) {
    throw UsageError(std::string("--monitor: ") + error.what(),
                     "--monitor 0 takes any port that is free");
  }
}

LiveSession::LiveSession(const Console& console, const MonitorOptions& options,
                         const SessionSetup& session, monitor::SessionControls controls)
    : monitor_(std::make_unique<monitor::SessionMonitor>(facts_of(session), session.instrument)),
      reconstruction_(reconstruction_of(options, session)) {
  const monitor::HttpAddress address = monitor_address(console, options);
  listening([&] {
    page_ = std::make_unique<monitor::SessionPage>(address, *monitor_, std::move(controls),
                                                   reconstruction_.get());
  });
  console.say(fmt::format("live page: {} (to look on)", page_->url()));
  console.say(fmt::format("           {} (may also pause and stop)", page_->control_url()));
}

void LiveSession::end(const std::string& how) {
  monitor_->ended(how);
  page_->let_the_end_be_seen(kPatienceOfPages);
}

std::unique_ptr<LiveSession> live_session(const Console& console, const MonitorOptions& options,
                                          const SessionSetup& session,
                                          monitor::SessionControls controls) {
  if (!options.port) {
    if (!options.basis.empty() || !options.address.empty()) {
      throw UsageError("--basis and --monitor-address are the live page's: found no --monitor");
    }
    return nullptr;
  }
  return std::make_unique<LiveSession>(console, options, session, std::move(controls));
}

}  // namespace gonio::cli
