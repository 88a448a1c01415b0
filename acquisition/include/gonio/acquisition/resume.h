#pragma once

#include <chrono>
#include <map>
#include <string>
#include <vector>

#include "gonio/acquisition/session_archive.h"

namespace gonio::acquisition {

/// What an archive says about going on with its session.
struct ResumeState {
  bool finished = false;
  /// Points not to be measured again: acknowledged with an outcome other than Failed, and all their
  /// frames are whole.
  std::map<int, PointOutcome> done;
  std::vector<std::string> again;  ///< acknowledged points that are, and why, a line each
  std::chrono::nanoseconds may_begin_at{
      0};         ///< just after the latest of the journal, session clock
  int parts = 1;  ///< so far: 1 and one for each time it was resumed
};

ResumeState resume_state(const SessionReader& archive);

}  // namespace gonio::acquisition
