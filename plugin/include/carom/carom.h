#ifndef CAROM_H
#define CAROM_H

#include <stddef.h>
#include <stdint.h>

/// The C interface of Carom: contact sound for a Bullet world (carom_attach) or for collisions that
/// any other engine reports (carom_create).
///
///     carom_attach(world, NULL, &sound);   // each step of the world is followed from within
///     carom_play(sound);                   // or carom_prepare_rendering, or carom_record
///     carom_destroy(sound);                // before or after the world goes
///
/// Or, with another engine:
///
///     carom_create(NULL, &sound);
///     carom_set_body(sound, 0, &body);                               // once for each body
///     carom_post(sound, &event), carom_advance(sound, time);         // in each step
///
/// C99 and C++; a thin layer over carom::Sound and carom::EventSound, which has all that they have
/// (a test compares the two) and whose headers say more about the models.
///
/// Units are SI. Three numbers are x, y, z in the world frame unless said otherwise; four are a
/// quaternion x, y, z, w of unit length.
///
/// Errors. Every call that can fail returns a carom_status, and carom_last_message() then says what
/// is wrong. A call that is refused has changed nothing. NULL where it is not said to be allowed,
/// numbers out of range and structs of a wrong size are CAROM_ERROR_ARGUMENT. What a sound refuses
/// is also told on standard error, or to carom_settings.on_message, once. No exception leaves
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

/// The measured responses of a head, which a binaural listener hears by.
typedef struct carom_head carom_head;

/// Sound over a Bullet world or over posted events.
typedef struct carom_sound carom_sound;

/// The modes of vibration by which a body rings.
typedef struct carom_modes carom_modes;

/// The bumps of a surface, which sound where a body slides or rolls.
typedef struct carom_texture carom_texture;

/// Places of a texture on a mesh.
typedef struct carom_texture_coordinates carom_texture_coordinates;

typedef int32_t carom_status;
enum {
  CAROM_OK = 0,
  CAROM_ERROR_ARGUMENT = 1,  ///< a wrong argument, or a call that the sound's state does not allow
  CAROM_ERROR_KIND = 2,      ///< a call for posted events on a Bullet world, or the reverse
  CAROM_ERROR_FILE = 3,      ///< a file cannot be read, or a recording not be begun or completed
  CAROM_ERROR_DEVICE = 4,    ///< no audio device, or none that can be opened
  CAROM_ERROR_MEMORY = 5,    ///< no memory
  CAROM_ERROR_INTERNAL = 6   ///< a fault of the library itself
};

/// The clock that rendered samples follow: carom_settings.clock.
enum {
  CAROM_CLOCK_REAL_TIME = 0,  ///< the caller's own, `latency` behind the simulation
  CAROM_CLOCK_SIMULATION = 1  ///< sample n is heard at n / sample rate; carom_frames_ready
};

/// The meaning of a sample of 1.0: carom_settings.level. Automatic: in range with nothing set, and
/// never above -1 dB; docs/plugin.md.
enum {
  CAROM_LEVEL_STANDARD = 0,  ///< automatic on a device and in recordings, unless full_scale is set
  CAROM_LEVEL_FIXED = 1,     ///< `full_scale`, or 2 Pa on a device, 20 Pa in recordings
  CAROM_LEVEL_AUTOMATIC = 2  ///< automatic in carom_render, too
};

/// The one of an event's two impulses that sounds: carom_settings.impulse.
enum { CAROM_IMPULSE_PHYSICAL = 0, CAROM_IMPULSE_APPLIED = 1 };

/// The way in which contacts that slide or roll become sound: carom_settings.lasting.
enum {
  CAROM_LASTING_EXACT = 0,  ///< each as the train of impulses that its bumps give
  CAROM_LASTING_HEARD = 1   ///< as much as is heard: the loudest exactly, the others as noise
};

/// The way in which an impact makes a body ring: carom_settings.ringing_contact.
enum {
  CAROM_RINGING_PRESSED = 0,  ///< modes take the force of rigid bodies: too loud where these are
                              ///< light beside what hits them
  CAROM_RINGING_COUPLED = 1   ///< both bodies' modes give way: none gets more energy than there is
};

/// The course of a contact force over time: carom_settings.pulse.
enum {
  CAROM_PULSE_HERTZ = 0,               ///< the elastic contact of Hertz: the default
  CAROM_PULSE_HALF_SINE = 1,           ///< pi/2 sin(pi u)
  CAROM_PULSE_GAUSSIAN = 2,            ///< exponent 10, unit impulse
  CAROM_PULSE_MITCHELL_NETRAVALI = 3,  ///< the cubic of Mitchell and Netravali
  CAROM_PULSE_COURSE_GAUSSIAN = 4      ///< pi/2 exp(-6 (u - 1/2)^2): 13.7 % too much impulse
};

/// The way in which a pulse becomes samples: carom_settings.sampling.
enum {
  CAROM_SAMPLING_BAND_LIMITED = 0,  ///< what samples can hold, at its exact time
  CAROM_SAMPLING_NAIVE = 1          ///< the pulse's value at each sample; for comparisons
};

/// The model by which a body's acceleration becomes pressure: carom_settings.radiation.
enum {
  CAROM_RADIATION_EXACT = 0,   ///< a rigid sphere at any frequency and distance
  CAROM_RADIATION_COMPACT = 1  ///< its limit for long wavelengths, far away; for comparisons
};

/// The model by which a mode of vibration becomes pressure: carom_settings.modal_radiation.
enum {
  CAROM_MODAL_RADIATION_DIRECTIONAL = 0,  ///< by its multipoles
  CAROM_MODAL_RADIATION_MONOPOLE = 1,     ///< by its volume velocity alone
  CAROM_MODAL_RADIATION_CONSTANT = 2      ///< alike for all modes of a body
};

/// The way in which bodies that are not spheres push the air: carom_settings.radiators.
enum {
  CAROM_RADIATORS_SOLVED = 0,            ///< by the added mass of their shape, once it is solved
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

/// The moment of a lasting contact: carom_contact.phase.
enum {
  CAROM_CONTACT_BEGIN = 0,   ///< the step in which it begins to bear load
  CAROM_CONTACT_DURING = 1,  ///< every later step with load
  CAROM_CONTACT_END = 2      ///< the step in which it is known to have ended, without load
};

/// A choice that may also be left open: carom_body_sound.silent.
enum { CAROM_UNSET = 0, CAROM_YES = 1, CAROM_NO = 2 };

/// Octave bands of absorptions and reverberation times: 125 Hz to 8 kHz.
enum { CAROM_BAND_COUNT = 7 };

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
  /// Path, UTF-8, of a SOFA file with the responses of the head of CAROM_LISTENER_BINAURAL; NULL:
  /// the default head. Read at creation for carom_settings.sample_rate, and for no other rate.
  const char* sofa_file;
  const carom_head* head;  ///< the head of CAROM_LISTENER_BINAURAL, in place of `sofa_file`; NULL
} carom_listener;

/// The impulse responses that were measured at the ears of a head, all around it.
typedef struct carom_head_responses {
  size_t size;         ///< bytes, of this struct
  double sample_rate;  ///< Hz, 8000 to 384000, of the responses
  /// Three numbers for each direction: to the source, in the listener's frame, of any length.
  const double* directions;
  /// Samples of each direction before its responses begin, left and right; NULL: none.
  const double* delays;
  /// The responses of each direction, the whole left one before the right one, in any unit.
  const float* samples;
  size_t direction_count;
  size_t length;  ///< samples of each response
} carom_head_responses;

/// An infinite plane wall. The air is where the normal points.
typedef struct carom_reflector {
  size_t size;                          ///< bytes, of this struct
  double normal[3];                     ///< unit, into the air
  double offset;                        ///< m, along the normal, from the world's origin
  double absorption[CAROM_BAND_COUNT];  ///< 0 to 1 by octave; not used if `surface` is given
  const char* surface;                  ///< name of a built-in surface, or NULL
} carom_reflector;

/// A room of plane walls, whose air is in front of all of them.
typedef struct carom_room {
  size_t size;                        ///< bytes, of this struct
  const carom_reflector* reflectors;  ///< all with the size of the first
  size_t reflector_count;
  int32_t order;     ///< successive reflections, 0 to 32; above 1 only for a box of six walls
  int32_t reserved;  ///< 0
} carom_room;

/// Late reverberation: the statistical diffuse field of a room.
typedef struct carom_reverb {
  size_t size;                           ///< bytes, of this struct
  double volume;                         ///< m^3, 0.1 to 1e6
  double surface;                        ///< m^2, at least that of a sphere of the volume
  double decay_times[CAROM_BAND_COUNT];  ///< s, T60 by octave, at least 0.05
  double onset;                          ///< s after the input, 0 to 1: when the tail begins
  double gain;                           ///< >= 0, on the level of the diffuse field
  double speed_of_sound;                 ///< m/s
  double silence;                        ///< Pa, >= 1e-15: below it the tail is cut off
  /// s, T60 at 16 kHz, at least 0.05; 0: it follows from that at 8 kHz and what the air absorbs.
  double decay_time_16khz;
  /// 1: the decay times are those of walls and air together, as one measures them; 0: the air's
  /// part is still to come, if carom_settings.air_absorption is 1.
  int32_t includes_air;
  int32_t reserved;  ///< 0
} carom_reverb;

/// A kind of surface with its published absorption.
typedef struct carom_surface {
  size_t size;                          ///< bytes, of this struct
  const char* name;                     ///< lives for ever
  const char* source;                   ///< the surface that was measured, and the publication
  double absorption[CAROM_BAND_COUNT];  ///< 0 to 1 by octave
} carom_surface;

/// Told a sentence, which is valid during the call only; `user` is carom_settings.message_user.
typedef void (*carom_message_function)(void* user, const char* sentence);

/// The settings of a sound.
typedef struct carom_settings {
  size_t size;                      ///< bytes, of this struct
  const carom_listener* listeners;  ///< all with the size of the first; read at creation only
  size_t listener_count;            ///< 0: a pair of microphones, placed automatically over a
                                    ///< Bullet world, and at the origin over events
  double sample_rate;               ///< Hz, 8000 to 192000: for recordings, and until prepared
  double latency;                   ///< s, 0 to 10, how far sound stays behind the simulation
  double air_density;               ///< kg/m^3
  double speed_of_sound;            ///< m/s
  double audible_threshold;         ///< Pa: events below it at every listener are left out
  double cpu_share;                 ///< share of one core that rendering may take, above 0
  size_t voices;                    ///< events that wait for their sound to begin, 1 to 65536
  size_t buses;                     ///< sizes of bodies times channels that sound, 1 to 65536
  double longest_contact;           ///< s: longer contacts are left out, above 0, up to 1
  double full_scale;                ///< Pa that come out as 1.0; 0: see `level`
  double limiter_ceiling;           ///< in units of the samples, where `limiter` is on
  double rest_speed;          ///< m/s, slower contacts of a Bullet world are rest and make no click
  int32_t limiter;            ///< 1: a look-ahead limiter at the end; 0: nothing is turned down
  int32_t clock;              ///< CAROM_CLOCK_...
  int32_t impulse;            ///< CAROM_IMPULSE_...
  int32_t radiators;          ///< CAROM_RADIATORS_...
  int32_t doppler;            ///< 1: motion within a contact is heard; 0: not
  int32_t reserved;           ///< 0
  size_t ringing_bodies;      ///< bodies times channels that ring at the same moment, 1 to 4096
  size_t modes;               ///< most modes of a ringing body, 1 to 4096: higher ones are left out
  size_t sliding_contacts;    ///< contacts that slide or roll at the same moment, 0 to 4096
  double limiter_look_ahead;  ///< s, 1e-4 to 0.02: the gain begins to fall so long before a peak
  double limiter_release;     ///< s, 1e-3 to 10: the gain has risen 63 % of its way again
  double contact_loss;        ///< loss factor of a lasting contact; 0: it damps nothing that rings
  const carom_room* room;     ///< NULL: open air; read at creation only
  const carom_reverb* reverb;  ///< NULL: none; read at creation only. See carom_reverb_of_box
  int32_t pulse;               ///< CAROM_PULSE_...
  int32_t sampling;            ///< CAROM_SAMPLING_...
  int32_t radiation;           ///< CAROM_RADIATION_...
  int32_t modal_radiation;     ///< CAROM_MODAL_RADIATION_...
  /// 1: contacts that lose energy last longer and are skewed (Hunt and Crossley), instead of
  /// `pulse`; 0: not.
  int32_t dissipative;
  int32_t level;  ///< CAROM_LEVEL_...
  /// Takes what there is to be told: each sentence of carom_last_message of a call on the sound
  /// that is refused, once. NULL: a line on standard error. It must not call the sound.
  carom_message_function on_message;
  void* message_user;  ///< handed to `on_message`
  /// CAROM_LASTING_...: how contacts that slide or roll become sound.
  int32_t lasting;
  int32_t ringing_contact;  ///< CAROM_RINGING_...: how an impact makes a body ring
  size_t slide_voices;      ///< contacts that are exact with CAROM_LASTING_HEARD: the loudest
  double metres_per_unit;   ///< m, > 0: length of the unit of a Bullet world, if not 1
  /// Temperature in K, 200 to 350, relative humidity, 0 to 1, and pressure in Pa, 1e3 to 2e5, of
  /// the air: they decide what it absorbs, and neither its density nor the speed of sound.
  double air_temperature;
  double air_humidity;
  double air_pressure;
  int32_t air_absorption;  ///< 1: the air absorbs sound on its way; 0: not
  int32_t air_reserved;    ///< 0
} carom_settings;

/// The statistics of a rough surface.
typedef struct carom_roughness {
  size_t size;                ///< bytes, of this struct
  double rms_height;          ///< m, 0 (smooth) to `correlation_length`
  double correlation_length;  ///< m, > 0
  double hurst;               ///< Hurst exponent, above 0, up to 1
} carom_roughness;

/// The material of a body.
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
  /// NULL: as rough as the built-in material of the same name, or else smooth: then it does not
  /// sound where it slides or rolls on another smooth one. Out: never NULL, lives for ever.
  const carom_roughness* roughness;
  /// 1, loss factor at 1 kHz, 0 to 2, and the exponent with which it goes with frequency, -2 to 2:
  /// a mode of frequency f falls by exp(-pi f loss_factor (f / 1 kHz)^loss_exponent t) in addition.
  double loss_factor;
  double loss_exponent;
  /// All at least 0. A body that rings loses by heat, too, which flows from where it is pressed to
  /// where it is stretched; nothing where one of the three is 0.
  double thermal_expansion;     ///< 1/K, linear
  double thermal_conductivity;  ///< W/(m K)
  double heat_capacity;         ///< J/(kg K)
} carom_material;

/// The surface of a solid as triangles.
typedef struct carom_mesh {
  size_t size;             ///< bytes, of this struct
  const double* vertices;  ///< m, x, y, z of each vertex
  size_t vertex_count;
  const uint32_t* triangles;  ///< three indices for each, counter-clockwise seen from outside
  size_t triangle_count;
} carom_mesh;

/// The interpretation of a normal map's colours.
typedef struct carom_normal_map {
  size_t size;             ///< bytes, of this struct
  double picture_size[2];  ///< m, 1e-6 to 1e6, width and height of the whole picture
  double strength;         ///< 0 to 1e6, on the slopes
  int32_t green_is_down;   ///< 1: green grows downwards (Direct3D); 0: up (OpenGL)
  int32_t reserved;        ///< 0
} carom_normal_map;

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
  double edge_radius;            ///< m, > 0, how blunt edges and corners are
  int32_t shape;                 ///< CAROM_SHAPE_...
  int32_t reserved;              ///< 0
  const carom_modes* modes;      ///< the modes in which it rings when it is hit; NULL: it does not
  const double* modes_origin;    ///< m, three: body's origin in the model; NULL: its mass centre
  const carom_texture* texture;  ///< its bumps; NULL: those of the material's roughness
  /// Places of `texture` on the body's mesh; NULL: it lies along the body's axes.
  const carom_texture_coordinates* texture_coordinates;
} carom_body;

/// The struct by which carom_assign_body, _shape and _user_index say the sound of bodies of a
/// Bullet world. A part that is left NULL or 0 says nothing: what was assigned before stays.
///
///     carom_body_sound sound;
///     carom_body_sound_init(&sound, sizeof sound);
///     sound.material = "steel";
typedef struct carom_body_sound {
  size_t size;                         ///< bytes, of this struct
  const char* material;                ///< name of a built-in one; not used with `own_material`
  const carom_material* own_material;  ///< or NULL
  const carom_modes* modes;            ///< the modes in which it rings when it is hit
  const carom_texture* texture;        ///< the bumps that sound where it slides or rolls
  const carom_texture_coordinates* texture_coordinates;  ///< places of `texture` on its mesh
  int32_t no_modes;                ///< 1: it does not ring, whatever its shape or user index says
  int32_t no_texture;              ///< 1: it has the bumps of its material's roughness
  int32_t no_texture_coordinates;  ///< 1: its texture lies along its axes
  /// CAROM_YES: nothing of it is heard, nor of what touches it, in contacts of the two: for ghosts
  /// and triggers. CAROM_NO: it is heard, whatever its shape or user index says. CAROM_UNSET.
  int32_t silent;
} carom_body_sound;

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
  /// 1: the next two are known, with which the modes of both bodies take part in the contact.
  int32_t has_other_pose;
  double other_position[3];     ///< m, centre of mass of the other body
  double other_orientation[4];  ///< other body's frame to world frame
} carom_event;

/// A lasting contact of two bodies (sliding, rolling or resting) over one step: one for each pair
/// and step, from CAROM_CONTACT_BEGIN to CAROM_CONTACT_END. The impulse of an impact is not in it.
typedef struct carom_contact {
  size_t size;                  ///< bytes, of this struct
  double time;                  ///< s, clock of the simulation: start of the step
  double duration;              ///< s, of the step
  uint32_t body;                ///< the body that `normal` points to
  uint32_t other;               ///< for it, normal, impulse and slip have the opposite sign
  double normal[3];             ///< unit, from the other body towards `body`
  double position[3];           ///< m, the point of contact at `time`
  double normal_load;           ///< N, >= 0, mean over the step
  double applied_impulse[3];    ///< N s, on `body`, over the step, friction too
  double radius;                ///< m, of curvature of `body` there, as carom_event.radius
  double other_radius;          ///< m, of the other body
  double slip_velocity[3];      ///< m/s, tangential: surface of `body` against the other surface
  double rolling_velocity[3];   ///< m/s, tangential: contact point against both surfaces' mean
  double body_position[3];      ///< m, centre of mass of `body` at `time`
  double body_orientation[4];   ///< body frame to world frame, at `time`
  double body_velocity[3];      ///< m/s, centre of mass, mean over the step
  double other_position[3];     ///< m, centre of mass of the other body at `time`
  double other_orientation[4];  ///< the other body's frame to world frame, at `time`
  double other_velocity[3];     ///< m/s, centre of mass, mean over the step
  double path_start[3];         ///< m, frame of `body`: the contact point at `time`
  double path_end[3];           ///< m, frame of `body`: the contact point at time + duration
  double other_path_start[3];   ///< m, frame of the other body: at `time`
  double other_path_end[3];     ///< m, frame of the other body: at time + duration
  int32_t phase;                ///< CAROM_CONTACT_...
  int32_t reserved;             ///< 0
} carom_contact;

/// Counts of what became of the events, and the cost of the sound. Counts are since the sound was
/// made; those of a sound that is neither played nor rendered are those of the recordings.
typedef struct carom_statistics {
  size_t size;            ///< bytes, of this struct
  uint64_t events;        ///< shares of bodies that can move or ring, but for the next three
  uint64_t immovable;     ///< shares of bodies that no impulse moves and that do not ring
  uint64_t rejected;      ///< never sounded: the sum of the counts that begin with rejected_
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
  uint64_t shapes_solved_late;    ///< shapes that a recording had to wait for in a step
  uint64_t unsolved_bodies;       ///< their surface is open or no solid: they sound as a sphere
  uint64_t links;                 ///< links of multibodies that can move
  uint64_t unsupported_contacts;  ///< contacts of shapes that the bridge cannot follow
  // Both kinds:
  uint64_t rings;  ///< events that made a body ring
  uint64_t
      modal_voices_exhausted;  ///< left out: rings, where more would sound than `ringing_bodies`
  uint64_t ringing;            ///< now: bodies times channels that ring
  uint64_t modes;              ///< now: modes that sound, of all bodies and channels
  uint64_t slides;             ///< steps of bodies that slide or roll, loud enough to be heard
  uint64_t inaudible_slides;   ///< such steps left out: below the threshold at every listener
  uint64_t slides_left_out;    ///< contacts left out: beyond `sliding_contacts`
  uint64_t silenced;           ///< shares in collisions with a body that is silent; Bullet only
  uint64_t undersampled;       ///< heard aliased: contacts shorter than 4 samples, sampled naively
  double peak;                 ///< Pa, the largest so far in any channel
  double peak_sample;          ///< the largest before a limiter, 1: full scale; 0: none is set
  /// A number of the event is not finite, or its orientation not of unit length.
  uint64_t rejected_not_finite;
  uint64_t rejected_unknown_body;  ///< a body was never set, was refused, or is removed
  /// Nothing approaches, or no mass stands against it: a speed or mass not above 0, a radius below.
  uint64_t rejected_no_contact;
  uint64_t rejected_too_long;  ///< the contact would last more than 20 s
  /// Samples or pressures cannot hold its time, place or force: it could exceed 1e10 Pa.
  uint64_t rejected_too_far;
  // Bullet worlds only:
  uint64_t refused_bodies;  ///< bodies that cannot sound: carom_unsolved_reason
  uint64_t
      unused_assignments;   ///< shapes and user indices with an assignment that no body has used
  uint64_t shapes_pending;  ///< now: shapes that a thread has yet to solve; Bullet only
  uint64_t slides_in_bed;   ///< steps of contacts heard as noise with others, not one by one
  uint64_t masked_slides;   ///< steps of contacts left out: too quiet beside others
  uint64_t masked;          ///< events left out: too quiet beside others
  // Each share that is posted has one fate: posted = silenced + skipped + immovable + rejected +
  // heard
  // + inaudible + masked + stolen + over_budget + no_bus + too_long + rings_left_out + queue_faults
  // + lost + waiting; see SoundStatistics.
  uint64_t heard;            ///< events whose sound has begun
  uint64_t lost;             ///< events whose output ended before their sound began
  uint64_t rings_left_out;   ///< events that only ring, left out: see modal_voices_exhausted
  uint64_t rejected_slides;  ///< steps of contacts with a number out of range: not heard
  uint64_t silenced_frames;  ///< frames of sounds left out as they were not finite
  uint64_t posted;           ///< shares of collisions that were handed over
  uint64_t waiting;          ///< now: shares that are yet to be heard, or left out
} carom_statistics;

/// A collision of two bodies of a Bullet world, which carom_on_collision tells of.
typedef struct carom_collision {
  size_t size;                     ///< bytes, of this struct
  double time;                     ///< s, clock of the simulation: first touch
  const btCollisionObject* body;   ///< NULL if it is no longer in the world
  const btCollisionObject* other;  ///< NULL if it is no longer in the world
  double position[3];              ///< m, of the contact
  double normal[3];                ///< unit, from `other` towards `body`
  double impulse;                  ///< N s, along the normal; see carom_settings.impulse
  double approach_speed;           ///< m/s, along the normal, just before touch
  double peak;                     ///< Pa, the largest of `peaks`
  const double* peaks;             ///< Pa, by listener: upper bounds of the clicks of both bodies
  const double* levels;            ///< dB over 20 uPa, by listener, of `peaks`; -INFINITY for 0
  size_t listener_count;           ///< numbers in `peaks` and `levels`
} carom_collision;

/// Told of a collision, which is valid during the call only; `user` is that of carom_on_collision.
typedef void (*carom_collision_function)(void* user, const carom_collision* collision);

// Library.

/// CAROM_VERSION of the library that runs. [any thread]
CAROM_API int32_t carom_version(void) CAROM_NOEXCEPT;
/// sizeof(btScalar) of the Bullet that the library was built with: 4 or 8; 0 for a library without
/// Bullet, which refuses all that is for Bullet worlds. [any thread]
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
CAROM_API carom_status carom_body_sound_init(carom_body_sound* sound, size_t size) CAROM_NOEXCEPT;
CAROM_API carom_status carom_event_init(carom_event* event, size_t size) CAROM_NOEXCEPT;
CAROM_API carom_status carom_contact_init(carom_contact* contact, size_t size) CAROM_NOEXCEPT;
CAROM_API carom_status carom_room_init(carom_room* room, size_t size) CAROM_NOEXCEPT;
CAROM_API carom_status carom_reflector_init(carom_reflector* reflector, size_t size) CAROM_NOEXCEPT;
CAROM_API carom_status carom_reverb_init(carom_reverb* reverb, size_t size) CAROM_NOEXCEPT;
CAROM_API carom_status carom_roughness_init(carom_roughness* roughness, size_t size) CAROM_NOEXCEPT;
CAROM_API carom_status carom_normal_map_init(carom_normal_map* map, size_t size) CAROM_NOEXCEPT;

// Built-in materials. [any thread]

CAROM_API size_t carom_material_count(void) CAROM_NOEXCEPT;
/// Gives the material of that index, below the count. `material->size` must be set.
CAROM_API carom_status carom_material_at(size_t index, carom_material* material) CAROM_NOEXCEPT;
/// Gives the material of that name. `material->size` must be set.
CAROM_API carom_status carom_find_material(const char* name,
                                           carom_material* material) CAROM_NOEXCEPT;

// Rooms: built-in surfaces of walls, and reverberation. [any thread]

CAROM_API size_t carom_surface_count(void) CAROM_NOEXCEPT;
/// Gives the surface of that index, below the count. `surface->size` must be set.
CAROM_API carom_status carom_surface_at(size_t index, carom_surface* surface) CAROM_NOEXCEPT;
/// Gives the surface of that name. `surface->size` must be set.
CAROM_API carom_status carom_find_surface(const char* name, carom_surface* surface) CAROM_NOEXCEPT;
/// Gives the surface that is assumed for a wall of a built-in material. `surface->size` must be
/// set.
CAROM_API carom_status carom_default_surface(const char* material,
                                             carom_surface* surface) CAROM_NOEXCEPT;
/// Gives the reverberation of a box by Eyring's formula, with its onset after the room's own
/// reflections, without the air in it (`includes_air` is 0). `reverb->size` must be set. Refuses a
/// room that is no box of six walls, and one whose walls absorb nothing in some band.
CAROM_API carom_status carom_reverb_of_box(const carom_room* room, double speed_of_sound,
                                           carom_reverb* reverb) CAROM_NOEXCEPT;

// Modes of bodies that ring.

/// Reads a model from a file (.carom_modes, which the C++ interface and the carom command write).
/// `*modes` becomes NULL on an error: CAROM_ERROR_FILE if there is no such file, or no model in it.
/// path: UTF-8. Blocks on the disk. [any thread]
CAROM_API carom_status carom_load_modes(const char* path, carom_modes** modes) CAROM_NOEXCEPT;
/// Reads a model from the bytes of such a file. name: for messages; may be NULL. [any thread]
CAROM_API carom_status carom_read_modes(const void* bytes, size_t byte_count, const char* name,
                                        carom_modes** modes) CAROM_NOEXCEPT;
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

// Heads of binaural listeners.

/// Makes a head of measured responses, for sounds of that sample rate (Hz) and of no other.
/// `*head` becomes NULL on an error: too few directions, responses that are silent or not finite.
/// [any thread]
CAROM_API carom_status carom_make_head(const carom_head_responses* responses, double sample_rate,
                                       carom_head** head) CAROM_NOEXCEPT;
/// Frees the handle; sounds that were created with the head keep it. NULL is fine. [any thread]
CAROM_API void carom_free_head(carom_head* head) CAROM_NOEXCEPT;

// Textures of bodies that slide and roll. A texture that cannot be made is NULL on return. [any
// thread]

/// Makes a random surface of that roughness, the same one for each seed.
CAROM_API carom_status carom_make_rough_texture(const carom_roughness* roughness, uint64_t seed,
                                                carom_texture** texture) CAROM_NOEXCEPT;
/// Makes a texture of the slopes of its height along u and v at the middles of width x height
/// texels (each a power of two, up to 8192), two numbers for each, row by row from v = 0 on. texel:
/// size (m) of a texel along u and v.
CAROM_API carom_status carom_make_texture(size_t width, size_t height, const double texel[2],
                                          const float* slopes,
                                          carom_texture** texture) CAROM_NOEXCEPT;
/// Reads the bumps of a PNG normal map. map: NULL for the defaults, a picture of 1 m by 1 m. path:
/// UTF-8. CAROM_ERROR_FILE if there is no such file, or no normal map in it. Blocks on the disk.
CAROM_API carom_status carom_load_normal_map(const char* path, const carom_normal_map* map,
                                             carom_texture** texture) CAROM_NOEXCEPT;
/// Reads a PNG normal map in memory. name: for messages.
CAROM_API carom_status carom_read_normal_map(const void* bytes, size_t byte_count, const char* name,
                                             const carom_normal_map* map,
                                             carom_texture** texture) CAROM_NOEXCEPT;
/// Frees the handle; bodies that were given the texture keep it. NULL is fine.
CAROM_API void carom_free_texture(carom_texture* texture) CAROM_NOEXCEPT;
/// Makes the places of a picture on a mesh in the body frame. corners: u to the right and v up,
/// from 0 to 1 over the picture, for each corner of each triangle: six numbers for a triangle.
CAROM_API carom_status carom_make_texture_coordinates(const carom_mesh* mesh, const double* corners,
                                                      carom_texture_coordinates** coordinates)
    CAROM_NOEXCEPT;
/// Gives width and height (m) of the picture as it lies on the mesh, averaged over its area: to be
/// the carom_normal_map.picture_size of a texture for it.
CAROM_API carom_status carom_texture_coordinates_size(const carom_texture_coordinates* coordinates,
                                                      double size[2]) CAROM_NOEXCEPT;
/// Frees the handle; bodies that were given the coordinates keep them. NULL is fine.
CAROM_API void carom_free_texture_coordinates(carom_texture_coordinates* coordinates)
    CAROM_NOEXCEPT;

// A sound's life.

/// Creates a sound over posted events. settings: NULL for the defaults. `*sound` becomes NULL on an
/// error.
CAROM_API carom_status carom_create(const carom_settings* settings,
                                    carom_sound** sound) CAROM_NOEXCEPT;
/// Creates a sound over a Bullet world. Every substep is followed from within. The world may be
/// destroyed first: then the sound's time stands still. Bodies get materials by their density until
/// one is set. The library and the host must use the same Bullet, in the same version and precision
/// (carom_bullet_scalar_size). Does not wait for the shapes of bodies, which a thread solves:
/// carom_prepare_bodies does. Not to be called in tick callbacks, as all else on the sound may be.
CAROM_API carom_status carom_attach(btDynamicsWorld* world, const carom_settings* settings,
                                    carom_sound** sound) CAROM_NOEXCEPT;
/// Detaches from the world, closes the device, completes a recording, and frees the handle in any
/// case. CAROM_ERROR_FILE if the recording went wrong. Not while carom_render runs. NULL is fine.
CAROM_API carom_status carom_destroy(carom_sound* sound) CAROM_NOEXCEPT;

// Posted events: for sounds from carom_create.

/// Sets what a body radiates as, from now on, instead of all that was set for it before. Solves its
/// shape if it is the first of its kind, which takes up to 0.3 s. A body that rings does so by the
/// material of its modes, and touches and clicks by its own.
CAROM_API carom_status carom_set_body(carom_sound* sound, uint32_t id,
                                      const carom_body* body) CAROM_NOEXCEPT;
/// Removes a body: its events are rejected from now on, but its present sound goes on.
CAROM_API carom_status carom_remove_body(carom_sound* sound, uint32_t id) CAROM_NOEXCEPT;
/// Hands over one body's share of a collision. A share that cannot sound (numbers that are not
/// finite, unknown bodies, nothing that approaches) is no error: carom_statistics.rejected counts
/// it.
CAROM_API carom_status carom_post(carom_sound* sound, const carom_event* event) CAROM_NOEXCEPT;
/// Hands over a lasting contact, over one step: bodies that slide or roll over bumps sound, and
/// what rings in bodies that press on each other is damped. One that is not finite or between
/// unknown bodies is no error: it is ignored.
CAROM_API carom_status carom_update_contact(carom_sound* sound,
                                            const carom_contact* contact) CAROM_NOEXCEPT;
/// Says where a body is at `seconds` of the simulation's clock: its origin and axes, as carom_event
/// has them. What rings is followed by that: distance, delay with Doppler effect and direction. To
/// be called after each step, before carom_advance, for bodies that move and may ring; a body for
/// which it is not called stands where it was struck. A time not after the last one begins anew, as
/// does a jump (a change of velocity by more than 15 m/s from one call to the next). Refused with
/// CAROM_ERROR_ARGUMENT: no such body, numbers that are not finite.
/// orientation: unit quaternion x, y, z, w; NULL for that of the world.
CAROM_API carom_status carom_move_body(carom_sound* sound, uint32_t id, double seconds,
                                       const double position[3],
                                       const double orientation[4]) CAROM_NOEXCEPT;
/// Takes note that the simulation has come to `seconds` (at most 1e9), and sends off what was
/// posted. The clock begins at 0: if it begins elsewhere, call this before the first carom_post. A
/// clock that goes back begins anew there.
CAROM_API carom_status carom_advance(carom_sound* sound, double seconds) CAROM_NOEXCEPT;

// Bullet worlds: for sounds from carom_attach. Objects that are not in the world are refused.

/// Assigns the parts that are set in `body_sound`, from now on, to one body. For each part of a
/// body the first of these counts that says something: its own, its shape's, its user index's; then
/// what is guessed: the material of its modes, or wood, plastic, granite or steel by its density;
/// no modes; bumps of the material's roughness. What is assigned to a body goes when it leaves the
/// world.
CAROM_API carom_status carom_assign_body(carom_sound* sound, const btCollisionObject* body,
                                         const carom_body_sound* body_sound) CAROM_NOEXCEPT;
/// Assigns the parts to all bodies with a shape, which is known by its address.
CAROM_API carom_status carom_assign_shape(carom_sound* sound, const btCollisionShape* shape,
                                          const carom_body_sound* body_sound) CAROM_NOEXCEPT;
/// Assigns the parts to all bodies with a user index (btCollisionObject::getUserIndex), which is -1
/// for those that have none.
CAROM_API carom_status carom_assign_user_index(carom_sound* sound, int user_index,
                                               const carom_body_sound* body_sound) CAROM_NOEXCEPT;
/// The next three take back all parts that were assigned to a body, a shape or a user index.
CAROM_API carom_status carom_unassign_body(carom_sound* sound,
                                           const btCollisionObject* body) CAROM_NOEXCEPT;
CAROM_API carom_status carom_unassign_shape(carom_sound* sound,
                                            const btCollisionShape* shape) CAROM_NOEXCEPT;
CAROM_API carom_status carom_unassign_user_index(carom_sound* sound, int user_index) CAROM_NOEXCEPT;
/// Sets the function that is told of each collision that is not silenced, at the end of the substep
/// in which its sound is decided, in order of time; NULL for none. It may call every function on
/// the sound, carom_destroy too. user: handed to it.
CAROM_API carom_status carom_on_collision(carom_sound* sound, carom_collision_function function,
                                          void* user) CAROM_NOEXCEPT;
/// Gives the material with which a body sounds; whether it was guessed from the body's density
/// (kg/m^3, mass over its shape's volume; 0 for one that cannot move). `material->size` must be
/// set; is_guessed and density may be NULL. Its name lives as long as the calling thread asks for
/// no other material.
CAROM_API carom_status carom_material_of(carom_sound* sound, const btCollisionObject* body,
                                         carom_material* material, int32_t* is_guessed,
                                         double* density) CAROM_NOEXCEPT;
/// Waits until all shapes are solved, those of bodies that were added since too, and takes changed
/// masses and shapes into account. Otherwise a thread solves them: in real time bodies sound as
/// spheres until then, and a recording waits for each before it first sounds.
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
/// 1 while a device plays; 0 otherwise, and for NULL.
CAROM_API int32_t carom_is_playing(const carom_sound* sound) CAROM_NOEXCEPT;
/// Prepares carom_render at a sample rate (Hz), or anew at another one, also while it runs.
CAROM_API carom_status carom_prepare_rendering(carom_sound* sound,
                                               double sample_rate) CAROM_NOEXCEPT;
/// Closes the device; rendering gives silence. Also while carom_render runs on another thread.
CAROM_API carom_status carom_stop(carom_sound* sound) CAROM_NOEXCEPT;
/// Renders into a WAV file of float samples, at carom_settings.sample_rate, from now on; 1.0 in it
/// is carom_settings.full_scale, or what carom_settings.level says. The file appears under its name
/// when it is finished; until then what was recorded can be played in NAME.wav.<hex>.partial.wav.
/// A recording that ends before, as on a full disk, says so at once (carom_recording_error), and
/// its sound up to there is kept. path: UTF-8.
CAROM_API carom_status carom_record(carom_sound* sound, const char* path) CAROM_NOEXCEPT;
/// Renders what is still to sound, and completes the file. Without a recording it does nothing.
CAROM_API carom_status carom_finish_recording(carom_sound* sound) CAROM_NOEXCEPT;
/// Writes all that happens from now on, instead of its sound, into a file, which appears under its
/// name when it is finished: `carom replay` makes the sound of it, from any seat. See
/// SoundOutput::recordRun of carom/sound_output.h for what is in it. path: UTF-8.
CAROM_API carom_status carom_record_run(carom_sound* sound, const char* path) CAROM_NOEXCEPT;
/// Completes the file of the run; refuses one without a step. Without a run it does nothing.
CAROM_API carom_status carom_finish_run(carom_sound* sound) CAROM_NOEXCEPT;
/// Keeps the last `seconds` (0 to 86400) of the run in memory, from now on, for carom_save_run; 0
/// ends it.
CAROM_API carom_status carom_keep_run(carom_sound* sound, double seconds) CAROM_NOEXCEPT;
/// Writes the run that is kept in memory, at most a second more of it than was asked for. It goes
/// on being kept. path: UTF-8.
CAROM_API carom_status carom_save_run(carom_sound* sound, const char* path) CAROM_NOEXCEPT;
/// Sets a factor on the output, 0 to 1000, changed within 20 ms; not on recordings.
CAROM_API carom_status carom_set_gain(carom_sound* sound, double gain) CAROM_NOEXCEPT;
/// Mutes the output (1), or unmutes it (0); not on recordings.
CAROM_API carom_status carom_set_muted(carom_sound* sound, int32_t muted) CAROM_NOEXCEPT;
/// Gives the statistics. `statistics->size` must be set.
CAROM_API carom_status carom_get_statistics(const carom_sound* sound,
                                            carom_statistics* statistics) CAROM_NOEXCEPT;

/// Writes why the shape of the latest body that was not solved could not be, as one sentence, or ""
/// if there is none, into `text` of `size` bytes: cut short where it is longer, and with a zero at
/// its end. Returns the length of the whole sentence without the zero; 0 for a NULL sound. text:
/// may be NULL if size is 0.
CAROM_API size_t carom_unsolved_reason(const carom_sound* sound, char* text,
                                       size_t size) CAROM_NOEXCEPT;

/// Writes by how much peaks exceed a fixed full scale, and the remedy, as one sentence, or "" if
/// they do not; as carom_unsolved_reason does.
CAROM_API size_t carom_warning(const carom_sound* sound, char* text, size_t size) CAROM_NOEXCEPT;
/// Writes the sentence that ended a recording before it was finished, as of a full disk, and says
/// where the sound up to there is, or "" if none was; as carom_unsolved_reason does.
CAROM_API size_t carom_recording_error(const carom_sound* sound, char* text,
                                       size_t size) CAROM_NOEXCEPT;

/// Writes in some sentences, a line each, what sounds and how loud, and why something is silent,
/// quiet or loud; as carom_unsolved_reason does.
CAROM_API size_t carom_report(const carom_sound* sound, char* text, size_t size) CAROM_NOEXCEPT;

/// Number of channels of all listeners together; 0 for NULL.
CAROM_API size_t carom_channel_count(const carom_sound* sound) CAROM_NOEXCEPT;
/// Rate (Hz) of the samples that are rendered or played; 0 for NULL.
CAROM_API double carom_sample_rate(const carom_sound* sound) CAROM_NOEXCEPT;
/// Frames that can be rendered with nothing in them late, with CAROM_CLOCK_SIMULATION; 0 for NULL.
CAROM_API size_t carom_frames_ready(const carom_sound* sound) CAROM_NOEXCEPT;
/// Renders into memory from now on, as carom_record does but in Pa and carom_settings.latency
/// later: as many frames as the simulation's time says, whatever its steps, the first of them
/// silent. Called once more it begins anew, silent, and drops what waits to be taken.
CAROM_API carom_status carom_capture(carom_sound* sound) CAROM_NOEXCEPT;
/// Frames that wait to be taken; 0 before carom_capture, and for NULL.
CAROM_API size_t carom_captured_frames(const carom_sound* sound) CAROM_NOEXCEPT;
/// Moves the oldest frames that wait to `samples`, an array of `count`: as many frames of
/// carom_channel_count samples as fit. Returns the number of frames; 0 for NULL.
CAROM_API size_t carom_take_captured(carom_sound* sound, float* samples,
                                     size_t count) CAROM_NOEXCEPT;
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
