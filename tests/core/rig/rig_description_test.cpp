#include "gonio/rig/rig_description.h"

#include <gtest/gtest.h>

namespace gonio::rig {
namespace {

TEST(Rig, ShippedRigIsValid) { EXPECT_NO_THROW(la2().validate()); }

}  // namespace
}  // namespace gonio::rig
