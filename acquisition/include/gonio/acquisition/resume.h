#pragma once

#include <chrono>
#include <map>
#include <string>
#include <vector>

#include "gonio/acquisition/decisions.h"
#include "gonio/acquisition/session.h"
#include "gonio/acquisition/session_archive.h"

namespace gonio::acquisition {

/// What an archive says about going on with its session.
struct ResumeState {
  bool finished = false;
  /// Points not to be measured again: acknowledged with an outcome other than Failed, and all their
  /// frames are whole; failed ones that a decision replaced.
  std::map<int, PointOutcome> done;
  std::vector<std::string> again;  ///< acknowledged points that are, and why, a line each
  std::chrono::nanoseconds may_begin_at{
      0};                      ///< just after the latest of the journal, session clock
  rig::Joints last_joints;     ///< of the last frame; empty: none
  std::vector<int> unchecked;  ///< of `done`, since the axes were last compared with home
  SentinelReading sentinel;    ///< the session's first; empty: none
  std::vector<LoggedDecision> decisions;  ///< what the session added to its plan or left out of it
  int parts = 1;                          ///< so far: 1 and one for each time it was resumed
};

/// Points that a check of the session suspects, and that were not measured again since, are not
/// done. Throws DataFormatError for decisions that cannot be read (decisions()).
ResumeState resume_state(const SessionReader& archive);

/// What run_session() has to know of it. The plan it is given has the points of the decisions
/// behind its own (add_points()).
SessionPart part_to_resume(const ResumeState& state);

}  // namespace gonio::acquisition
