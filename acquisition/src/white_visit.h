#pragma once

#include "capture_context.h"

namespace gonio::acquisition {

enum class WhiteVisit { opening, between, closing };

/// Goes to the white, takes it in every channel, and a lamp-off frame, and puts the sample back.
/// All visits take the same exposures: what differs between them then is the light. Returns why it
/// is to be taken again, which the archive then tells (kWhiteAgainNote); empty: it is good. Throws
/// Fault when the white is no reference for anything: dark, or saturated.
std::string visit_white(const CaptureContext& context, const rig::Joints& joints, WhiteVisit visit);

}  // namespace gonio::acquisition
