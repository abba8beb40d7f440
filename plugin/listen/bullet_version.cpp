#include <LinearMath/btScalar.h>

#include "plugin/listen/bullet_function.h"

namespace carom::listen {

const int kCompiledVersion = BT_BULLET_VERSION;

}  // namespace carom::listen
