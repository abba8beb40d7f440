#ifndef CAROM_TESTS_PLUGIN_C_API_SUPPORT_H
#define CAROM_TESTS_PLUGIN_C_API_SUPPORT_H

#include <stddef.h>

#include "carom/carom.h"

// Helpers of the tests of the C interface that cannot be written in C.

#ifdef __cplusplus
extern "C" {
#endif

/// The strike: a steel ball hits an immovable wooden block and is heard by one microphone. The C
/// tests make the same collision by themselves.
#define STRIKE_RADIUS 0.01         /* m */
#define STRIKE_MASS 0.0374         /* kg */
#define STRIKE_TIME 0.1003         /* s */
#define STRIKE_SPEED 1.25          /* m/s */
#define STRIKE_RESTITUTION 0.7     /* 1 */
#define STRIKE_HEIGHT 0.5          /* m, of the microphone above the ball's centre */
#define STRIKE_SAMPLE_RATE 48000.0 /* Hz, the default of SynthSettings */

/// Renders the strike by carom::Synth, in Pa from sample 0 on, without the C interface.
void support_render_strike(float* samples, size_t frames);

/// Writes a model of one mode that sounds much louder than the strike: a body that moves along y.
void support_write_modes(const char* path, double frequency, double decay_rate);

/// A Bullet world with a floor at y = 0 and a ball whose lowest point is 0.2 m above it.
typedef struct support_world support_world;
support_world* support_world_make(void);
void support_world_free(support_world* world);
btDynamicsWorld* support_world_bullet(support_world* world);
const btCollisionObject* support_world_ball(support_world* world);    ///< its user index is 7
const btCollisionShape* support_world_shape(support_world* world);    ///< the ball's shape
const btCollisionObject* support_world_absent(support_world* world);  ///< is not in the world
void support_world_step(support_world* world, double seconds);        ///< in substeps of 1/240 s

/// Sets the audio driver, one of SDL's names, that the next device is opened with.
void support_set_audio_driver(const char* name);

/// From now on `operator new` gives that many pieces of memory, and then fails once; negative: it
/// never fails.
void support_fail_after(long pieces);

#ifdef __cplusplus
}
#endif

#endif
