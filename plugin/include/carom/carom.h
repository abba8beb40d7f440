#ifndef CAROM_H
#define CAROM_H

#include <stddef.h>
#include <stdint.h>

/// The C interface of Carom: contact sound for a Bullet world (carom_attach) or for collisions that
/// any other engine reports (carom_create). C99 and C++; a thin layer over carom::Sound and
/// carom::EventSound, whose headers say more about the models.
///
///     carom_sound* sound = NULL;
///     if (carom_create(NULL, &sound) != CAROM_OK) puts(carom_last_message());
///     carom_set_body(sound, 0, &body);        // once
///     carom_play(sound);                      // or carom_prepare_rendering, or carom_record
///     ...
///     carom_post(sound, &event);              // while a step is worked on
///     carom_advance(sound, time);             // at its end
///     ...
///     carom_destroy(sound);
///
/// Units are SI. Three numbers are x, y, z in the world frame unless said otherwise; four are a
/// quaternion x, y, z, w of unit length.
///
/// Errors. Every call that can fail returns a carom_status, and carom_last_message() then says what
/// is wrong. A call that is refused has changed nothing. NULL where it is not said to be allowed,
/// numbers out of range and structs of a wrong size are CAROM_ERROR_ARGUMENT. No exception leaves
/// this interface. A handle after carom_destroy is not checked.
///
/// Threads. One thread at a time, that of the simulation, calls the functions of one handle.
/// Functions that others may call say so: [audio thread] is one other thread, [any thread] any
/// number. Different handles have nothing to do with each other.
///
/// Growth. Structs begin with their size in bytes: set it by the struct's init function, or to
/// sizeof where there is none. New fields come at the end. A library that knows more fields takes
/// their defaults; one that knows fewer accepts the rest if it is zero, as its init function leaves
/// it.

#define CAROM_VERSION_MAJOR 0
#define CAROM_VERSION_MINOR 1
#define CAROM_VERSION_PATCH 0
/// One number that grows with the version: 1.2.3 is 10203.
#define CAROM_VERSION \
  (CAROM_VERSION_MAJOR * 10000 + CAROM_VERSION_MINOR * 100 + CAROM_VERSION_PATCH)

#if defined(CAROM_SHARED) && defined(_WIN32)
#ifdef CAROM_BUILDING_SHARED
#define CAROM_API __declspec(dllexport)
#else
#define CAROM_API __declspec(dllimport)
#endif
#elif defined(__GNUC__)
#define CAROM_API __attribute__((visibility("default")))
#else
#define CAROM_API
#endif

#ifdef __cplusplus
#define CAROM_NOEXCEPT noexcept
class btCollisionObject;
class btCollisionShape;
class btDynamicsWorld;
extern "C" {
#else
#define CAROM_NOEXCEPT
typedef struct btCollisionObject btCollisionObject;
typedef struct btCollisionShape btCollisionShape;
typedef struct btDynamicsWorld btDynamicsWorld;
#endif

/// Sound over a Bullet world or over posted events.
typedef struct carom_sound carom_sound;

/// The modes of vibration by which a body rings.
typedef struct carom_modes carom_modes;

typedef int32_t carom_status;
enum {
  CAROM_OK = 0,
  CAROM_ERROR_ARGUMENT = 1,  ///< a wrong argument, or a call that the sound's state does not allow
  CAROM_ERROR_KIND = 2,      ///< a call for posted events on a Bullet world, or the reverse
  CAROM_ERROR_FILE = 3,      ///< a recording cannot be begun or completed, or modes not be read
  CAROM_ERROR_DEVICE = 4,    ///< no audio device, or none that can be opened
  CAROM_ERROR_MEMORY = 5,    ///< no memory
  CAROM_ERROR_INTERNAL = 6   ///< a fault of the library itself
};

/// The clock that rendered samples follow: carom_settings.clock.
enum {
  CAROM_CLOCK_REAL_TIME = 0,  ///< the caller's own, `latency` behind the simulation
  CAROM_CLOCK_SIMULATION = 1  ///< sample n is heard at n / sample rate; carom_frames_ready
};

/// The one of an event's two impulses that sounds: carom_settings.impulse.
enum { CAROM_IMPULSE_PHYSICAL = 0, CAROM_IMPULSE_APPLIED = 1 };

/// The way in which bodies that are not spheres push the air: carom_settings.radiators.
enum {
  CAROM_RADIATORS_SOLVED = 0,            ///< by the added mass of their shape, solved once each
  CAROM_RADIATORS_EQUIVALENT_SPHERE = 1  ///< as the sphere of their volume; costs nothing
};

/// The kind of a listener: carom_listener.format. Channels are left, right.
enum {
  CAROM_LISTENER_MONO = 0,             ///< one microphone, one channel
  CAROM_LISTENER_SPACED_PAIR = 1,      ///< two microphones `spacing` apart
  CAROM_LISTENER_COINCIDENT_PAIR = 2,  ///< two in one place, turned apart
  CAROM_LISTENER_BINAURAL = 3          ///< the ears of a head, for headphones; the default head
};

/// The shape of a body, for its sound: carom_body.shape.
enum { CAROM_SHAPE_SPHERE = 0, CAROM_SHAPE_BOX = 1, CAROM_SHAPE_MESH = 2 };

/// A place where sound is heard. It looks along its -Z; +Y is up, +X is to its right.
typedef struct carom_listener {
  size_t size;            ///< bytes, of this struct
  const char* name;       ///< for messages; may be NULL
  double position[3];     ///< m
  double orientation[4];  ///< listener frame to world frame
  double spacing;         ///< m, of a spaced pair
  double half_angle;      ///< rad, from straight ahead to the axis of either microphone of a pair
  double pattern;         ///< 0 omnidirectional, 0.5 cardioid, 1 figure of eight; < 0: the usual
  int32_t format;         ///< CAROM_LISTENER_...
  int32_t reserved;       ///< 0
} carom_listener;

/// The settings of a sound. Rooms are not in this interface: the air is open.
typedef struct carom_settings {
  size_t size;                      ///< bytes, of this struct
  const carom_listener* listeners;  ///< all with the size of the first; read at creation only
  size_t listener_count;            ///< 0: a pair of microphones at the origin
  double sample_rate;               ///< Hz, 8000 to 192000: for recordings, and until prepared
  double latency;                   ///< s, 0 to 10, how far sound stays behind the simulation
  double air_density;               ///< kg/m^3
  double speed_of_sound;            ///< m/s
  double audible_threshold;         ///< Pa: events below it at every listener are left out
  double cpu_share;                 ///< share of one core that rendering may take, above 0
  size_t voices;                    ///< events that wait for their sound to begin, 1 to 65536
  size_t buses;                     ///< sizes of bodies times channels that sound, 1 to 65536
  double longest_contact;           ///< s: longer contacts are left out, above 0, up to 1
  double full_scale;                ///< Pa that come out as 1.0; 0: samples are pascals
  double limiter_ceiling;           ///< in units of the samples, where `limiter` is on
  double rest_speed;      ///< m/s, slower contacts of a Bullet world are rest and make no click
  int32_t limiter;        ///< 1: a look-ahead limiter at the end; 0: nothing is turned down
  int32_t clock;          ///< CAROM_CLOCK_...
  int32_t impulse;        ///< CAROM_IMPULSE_...
  int32_t radiators;      ///< CAROM_RADIATORS_...
  int32_t doppler;        ///< 1: motion within a contact is heard; 0: not
  int32_t reserved;       ///< 0
  size_t ringing_bodies;  ///< bodies times channels that ring at the same moment, 1 to 4096
  size_t modes;           ///< most modes of a ringing body, 1 to 4096: higher ones are left out
} carom_settings;

/// The material of a body. Its surface is as rough as that of the built-in one of the same name, or
/// else smooth: then it does not sound where it slides or rolls on another smooth one.
typedef struct carom_material {
  size_t size;            ///< bytes, of this struct
  const char* name;       ///< may be NULL where a material is handed in; out: lives for ever
  double density;         ///< kg/m^3, > 0
  double youngs_modulus;  ///< Pa, > 0
  double poissons_ratio;  ///< 0 to below 0.5
  double restitution;     ///< 0 to 1, of two bodies of this material
  /// 1/s and s, 0 or above, Rayleigh damping: a mode of angular frequency w falls as
  /// exp(-(alpha + beta w^2) t / 2). For computing modes; those of a carom_modes have their own.
  double damping_alpha;
  double damping_beta;
} carom_material;

/// A body of posted events as it radiates. Its frame has its origin in the centre of mass.
typedef struct carom_body {
  size_t size;           ///< bytes, of this struct
  const char* material;  ///< name of a built-in one; not used if `own_material` is given
  const carom_material* own_material;  ///< or NULL
  double mass;    ///< kg, > 0; INFINITY for a body that no impulse moves: it does not click
  double radius;  ///< m, > 0, of a sphere
  double half_extents[3];  ///< m, > 0, of a box
  /// m, body frame, x, y, z of each vertex of a mesh. The mesh must be closed.
  const double* vertices;
  size_t vertex_count;
  /// Three indices into `vertices` for each triangle, counter-clockwise seen from outside.
  const uint32_t* triangles;
  size_t triangle_count;
  /// kg m^2, body frame, row by row, of a box or mesh: symmetric, positive definite. All 0: the
  /// inertia of a solid of even density. INFINITY on a diagonal, with 0 everywhere beside it: the
  /// body does not turn about that axis.
  double inertia[9];
  double edge_radius;  ///< m, > 0, how blunt edges and corners are
  int32_t shape;       ///< CAROM_SHAPE_...
  int32_t reserved;    ///< 0
} carom_body;

/// One body's share of one collision. A collision makes two, one for each body, with the same time
/// and opposite impulses and normals; the share of an immovable body that does not ring may be left
/// out.
typedef struct carom_event {
  size_t size;                 ///< bytes, of this struct
  double time;                 ///< s, clock of the simulation: the instant of first touch
  uint32_t body;               ///< the body whose share this is; a number of the host's choice
  uint32_t other;              ///< the body it hit
  double impulse[3];           ///< N s, on `body`, along the normal
  double applied_impulse[3];   ///< N s, what the engine itself applied; see `has_applied_impulse`
  double position[3];          ///< m, the point of contact
  double normal[3];            ///< unit, from the other body towards `body`
  double approach_speed;       ///< m/s, > 0, along the normal, just before touching
  double effective_mass;       ///< kg, of the pair: 1/m = 1/m1 + 1/m2 + what rotation adds
  double radius;               ///< m, of curvature of `body` there: INFINITY if flat, 0 at an edge
  double other_radius;         ///< m, of the other body
  double body_position[3];     ///< m, centre of mass of `body`
  double body_orientation[4];  ///< body frame to world frame
  double body_velocity[3];     ///< m/s, centre of mass, just before
  double body_angular_velocity[3];  ///< rad/s, just before
  int32_t has_applied_impulse;      ///< 1: `applied_impulse` is known
  int32_t reserved;                 ///< 0
} carom_event;

/// Counts of what became of the events, and the cost of the sound. Counts are since the sound was
/// made; those of a sound that is neither played nor rendered are those of the recordings.
typedef struct carom_statistics {
  size_t size;            ///< bytes, of this struct
  uint64_t events;        ///< shares of bodies that can move or ring, but for the next three
  uint64_t immovable;     ///< shares of bodies that no impulse moves and that do not ring
  uint64_t rejected;      ///< not finite, unknown body, no approach, over 20 s
  uint64_t skipped;       ///< no samples were taken yet, or the simulation ran ahead of time
  uint64_t inaudible;     ///< left out: below the threshold at every listener
  uint64_t stolen;        ///< left out: the quietest, where more than `voices` waited
  uint64_t over_budget;   ///< left out: the quietest, where they would cost too much
  uint64_t no_bus;        ///< left out: more sizes and paths at once than `buses`
  uint64_t too_long;      ///< left out: contact longer than `longest_contact`
  uint64_t queue_faults;  ///< left out: samples are not taken, or too rarely
  uint64_t late;          ///< heard later than they happened, as they came after their time
  uint64_t stalls;        ///< the simulation fell behind by more than the look-ahead
  uint64_t jumps;         ///< the clock of the simulation went back
  uint64_t voices;        ///< now: events that wait for their sound to begin
  uint64_t buses;         ///< now: buses that are not silent
  double cpu_share;       ///< share of one core, over the last second or so
  double worst_block;     ///< the largest share of its own duration that a block has taken
  double gain_reduction;  ///< dB, the most that a limiter has turned down
  // Bullet worlds only:
  uint64_t solved_shapes;         ///< shapes whose added mass is known; equal ones count once
  uint64_t shapes_solved_late;    ///< shapes solved only when a body of theirs first collided
  uint64_t unsolved_bodies;       ///< their surface is open or no solid: they sound as a sphere
  uint64_t links;                 ///< links of multibodies that can move
  uint64_t unsupported_contacts;  ///< contacts of shapes that the bridge cannot follow
  // Both kinds:
  uint64_t rings;  ///< events that made a body ring
  uint64_t
      modal_voices_exhausted;  ///< left out: rings, where more would sound than `ringing_bodies`
  uint64_t ringing;            ///< now: bodies times channels that ring
  uint64_t modes;              ///< now: modes that sound, of all bodies and channels
} carom_statistics;

// Library.

/// CAROM_VERSION of the library that runs. [any thread]
CAROM_API int32_t carom_version(void) CAROM_NOEXCEPT;
/// sizeof(btScalar) of the Bullet that the library was built with: 4 or 8. [any thread]
CAROM_API size_t carom_bullet_scalar_size(void) CAROM_NOEXCEPT;
/// A status in a few words; never NULL. [any thread]
CAROM_API const char* carom_status_text(carom_status status) CAROM_NOEXCEPT;
/// Says in one sentence what was wrong in the latest call of this thread that failed, and what
/// would be accepted; "" if none has failed. Valid until the next one fails. Never NULL.
/// [any thread]
CAROM_API const char* carom_last_message(void) CAROM_NOEXCEPT;

// Init functions: they fill structs with the defaults. `size` is sizeof the struct, as the caller
// knows it. [any thread]

CAROM_API carom_status carom_settings_init(carom_settings* settings, size_t size) CAROM_NOEXCEPT;
CAROM_API carom_status carom_listener_init(carom_listener* listener, size_t size) CAROM_NOEXCEPT;
CAROM_API carom_status carom_body_init(carom_body* body, size_t size) CAROM_NOEXCEPT;
CAROM_API carom_status carom_event_init(carom_event* event, size_t size) CAROM_NOEXCEPT;

// Built-in materials. [any thread]

CAROM_API size_t carom_material_count(void) CAROM_NOEXCEPT;
/// Gives the material of that index, below the count. `material->size` must be set.
CAROM_API carom_status carom_material_at(size_t index, carom_material* material) CAROM_NOEXCEPT;
/// Gives the material of that name. `material->size` must be set.
CAROM_API carom_status carom_find_material(const char* name,
                                           carom_material* material) CAROM_NOEXCEPT;

// Modes of bodies that ring.

/// Reads a model from a file (.carom_modes, which the C++ interface and the carom command write).
/// `*modes` becomes NULL on an error: CAROM_ERROR_FILE if there is no such file, or no model in it.
/// path: UTF-8. Blocks on the disk. [any thread]
CAROM_API carom_status carom_load_modes(const char* path, carom_modes** modes) CAROM_NOEXCEPT;
/// Frees the handle; bodies that were given the modes keep them and ring on. NULL is fine.
/// [any thread]
CAROM_API void carom_free_modes(carom_modes* modes) CAROM_NOEXCEPT;
/// Number of modes, which may be 0; 0 for NULL. [any thread]
CAROM_API size_t carom_mode_count(const carom_modes* modes) CAROM_NOEXCEPT;
/// Gives the undamped frequency (Hz) of the mode of that index, below the count, ascending in
/// frequency, and the rate (1/s) at which its amplitude falls, as exp(-decay_rate t). Either may be
/// NULL. [any thread]
CAROM_API carom_status carom_mode_at(const carom_modes* modes, size_t index, double* frequency,
                                     double* decay_rate) CAROM_NOEXCEPT;

// A sound's life.

/// Creates a sound over posted events. settings: NULL for the defaults. `*sound` becomes NULL on an
/// error.
CAROM_API carom_status carom_create(const carom_settings* settings,
                                    carom_sound** sound) CAROM_NOEXCEPT;
/// Creates a sound over a Bullet world, which must outlive it. Every substep is followed from
/// within. Bodies get materials by their density until one is set. The library and the host must
/// use the same Bullet, in the same version and precision (carom_bullet_scalar_size). Solves the
/// shapes that are there: a tenth of a second for each that is no sphere. Not to be called in tick
/// callbacks.
CAROM_API carom_status carom_attach(btDynamicsWorld* world, const carom_settings* settings,
                                    carom_sound** sound) CAROM_NOEXCEPT;
/// Detaches from the world, closes the device, completes a recording, and frees the handle in any
/// case. CAROM_ERROR_FILE if the recording went wrong. Not while carom_render runs. NULL is fine.
CAROM_API carom_status carom_destroy(carom_sound* sound) CAROM_NOEXCEPT;

// Posted events: for sounds from carom_create.

/// Sets what a body radiates as, from now on. Solves its shape if it is the first of its kind,
/// which takes up to 0.3 s.
CAROM_API carom_status carom_set_body(carom_sound* sound, uint32_t id,
                                      const carom_body* body) CAROM_NOEXCEPT;
/// Makes a body that was set ring when it is hit, from now on, with its frame's axes those of the
/// model and its origin in the model's centre of mass. Many bodies may share modes. NULL: it does
/// not ring. The modes are kept when the body is set anew, until it is removed. It rings by the
/// material of the model, and touches and clicks by that of carom_body.
CAROM_API carom_status carom_set_body_modes(carom_sound* sound, uint32_t id,
                                            const carom_modes* modes) CAROM_NOEXCEPT;
/// Removes a body: its events are rejected from now on, but its present sound goes on.
CAROM_API carom_status carom_remove_body(carom_sound* sound, uint32_t id) CAROM_NOEXCEPT;
/// Hands over one body's share of a collision. A share that cannot sound (numbers that are not
/// finite, unknown bodies, nothing that approaches) is no error: carom_statistics.rejected counts
/// it.
CAROM_API carom_status carom_post(carom_sound* sound, const carom_event* event) CAROM_NOEXCEPT;
/// Takes note that the simulation has come to `seconds` (at most 1e9), and sends off what was
/// posted. The clock begins at 0: if it begins elsewhere, call this before the first carom_post. A
/// clock that goes back begins anew there.
CAROM_API carom_status carom_advance(carom_sound* sound, double seconds) CAROM_NOEXCEPT;

// Bullet worlds: for sounds from carom_attach. Objects that are not in the world are refused.

/// Sets a built-in material for one body.
CAROM_API carom_status carom_set_object_material(carom_sound* sound,
                                                 const btCollisionObject* object,
                                                 const char* name) CAROM_NOEXCEPT;
/// Sets a built-in material for all bodies that have a shape and no material of their own.
CAROM_API carom_status carom_set_shape_material(carom_sound* sound, const btCollisionShape* shape,
                                                const char* name) CAROM_NOEXCEPT;
/// Sets a built-in material for all bodies with a user index (btCollisionObject::getUserIndex) that
/// have no other.
CAROM_API carom_status carom_set_user_index_material(carom_sound* sound, int user_index,
                                                     const char* name) CAROM_NOEXCEPT;
/// The next three set a material of the host's own in the same way.
CAROM_API carom_status carom_set_object_own_material(carom_sound* sound,
                                                     const btCollisionObject* object,
                                                     const carom_material* material) CAROM_NOEXCEPT;
CAROM_API carom_status carom_set_shape_own_material(carom_sound* sound,
                                                    const btCollisionShape* shape,
                                                    const carom_material* material) CAROM_NOEXCEPT;
CAROM_API carom_status carom_set_user_index_own_material(
    carom_sound* sound, int user_index, const carom_material* material) CAROM_NOEXCEPT;
/// The next three make bodies ring when they are hit, from now on: one body, all bodies with a
/// shape, or all bodies with a user index. In this order, the first that is set counts for a body.
/// NULL for a body: it does not ring, whatever is set for its shape and its user index. The model's
/// axes are those of the body; a body that moves has its origin in the model's centre of mass, a
/// static or kinematic one in the model's own. A body without a material of its own gets the
/// model's.
CAROM_API carom_status carom_set_object_modes(carom_sound* sound, const btCollisionObject* object,
                                              const carom_modes* modes) CAROM_NOEXCEPT;
CAROM_API carom_status carom_set_shape_modes(carom_sound* sound, const btCollisionShape* shape,
                                             const carom_modes* modes) CAROM_NOEXCEPT;
CAROM_API carom_status carom_set_user_index_modes(carom_sound* sound, int user_index,
                                                  const carom_modes* modes) CAROM_NOEXCEPT;
/// Solves the shapes of bodies that were added since, so that no collision need wait for it, and
/// takes changed masses and shapes into account.
CAROM_API carom_status carom_prepare_bodies(carom_sound* sound) CAROM_NOEXCEPT;

// Both kinds.

/// Sets where a listener is at the present time of the simulation: once a frame, if it moves. Of
/// several calls at the same time the last counts. At most 1e12 m from the origin.
/// orientation: NULL for that of the world.
CAROM_API carom_status carom_set_listener(carom_sound* sound, size_t listener,
                                          const double position[3],
                                          const double orientation[4]) CAROM_NOEXCEPT;
/// Time of the simulation (s); 0 for NULL.
CAROM_API double carom_time(const carom_sound* sound) CAROM_NOEXCEPT;
/// Takes note that the simulation rests until its next step: the time that goes by meanwhile does
/// not count as a stall.
CAROM_API carom_status carom_pause(carom_sound* sound) CAROM_NOEXCEPT;
/// Takes note that the simulation runs at `scale` times real time, 0.001 to 1000.
CAROM_API carom_status carom_set_time_scale(carom_sound* sound, double scale) CAROM_NOEXCEPT;
/// Plays on the default audio device, unless it does already. CAROM_ERROR_DEVICE if that cannot be.
CAROM_API carom_status carom_play(carom_sound* sound) CAROM_NOEXCEPT;
/// Prepares carom_render at a sample rate (Hz), or anew at another one. Not while it runs.
CAROM_API carom_status carom_prepare_rendering(carom_sound* sound,
                                               double sample_rate) CAROM_NOEXCEPT;
/// Closes the device; rendering gives silence. Not while carom_render runs.
CAROM_API carom_status carom_stop(carom_sound* sound) CAROM_NOEXCEPT;
/// Renders into a WAV file of float samples, at carom_settings.sample_rate, from now on; 1.0 in it
/// is carom_settings.full_scale, or 20 Pa. The file appears under its name when it is finished.
/// path: UTF-8.
CAROM_API carom_status carom_record(carom_sound* sound, const char* path) CAROM_NOEXCEPT;
/// Renders what is still to sound, and completes the file. Without a recording it does nothing.
CAROM_API carom_status carom_finish_recording(carom_sound* sound) CAROM_NOEXCEPT;
/// Sets a factor on the output, 0 to 1000, changed within 20 ms; not on recordings.
CAROM_API carom_status carom_set_gain(carom_sound* sound, double gain) CAROM_NOEXCEPT;
/// Mutes the output (1), or unmutes it (0); not on recordings.
CAROM_API carom_status carom_set_muted(carom_sound* sound, int32_t muted) CAROM_NOEXCEPT;
/// Gives the statistics. `statistics->size` must be set.
CAROM_API carom_status carom_get_statistics(const carom_sound* sound,
                                            carom_statistics* statistics) CAROM_NOEXCEPT;

/// Number of channels of all listeners together; 0 for NULL.
CAROM_API size_t carom_channel_count(const carom_sound* sound) CAROM_NOEXCEPT;
/// Rate (Hz) of the samples that are rendered or played; 0 for NULL.
CAROM_API double carom_sample_rate(const carom_sound* sound) CAROM_NOEXCEPT;
/// Frames that can be rendered with nothing in them late, with CAROM_CLOCK_SIMULATION; 0 for NULL.
CAROM_API size_t carom_frames_ready(const carom_sound* sound) CAROM_NOEXCEPT;
/// Frames by which a limiter delays the rendered samples; 0 without one, and for NULL.
CAROM_API size_t carom_output_delay(const carom_sound* sound) CAROM_NOEXCEPT;

/// Overwrites `frames` samples of each of `channel_count` channels, in Pa or by
/// carom_settings.full_scale. The count must be carom_channel_count. Silence before
/// carom_prepare_rendering. Never allocates, locks or waits; on an error nothing is written, and
/// carom_last_message does not change. [audio thread]
CAROM_API carom_status carom_render(carom_sound* sound, float* const* channels,
                                    size_t channel_count, size_t frames) CAROM_NOEXCEPT;
/// Renders interleaved samples: `channel_count` of them for each of the frames. [audio thread]
CAROM_API carom_status carom_render_interleaved(carom_sound* sound, float* samples,
                                                size_t channel_count, size_t frames) CAROM_NOEXCEPT;

#ifdef __cplusplus
}
#endif

#endif
