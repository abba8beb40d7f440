// Tests the C interface, from C. Each claim is a function; main runs them all and says which fail.

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "carom/carom.h"
#include "tests/plugin/c_api_support.h"

static int failures = 0;

static void expect(int holds, const char* what, int line) {
  if (holds) return;
  ++failures;
  printf("%s:%d: not so: %s (last message: %s)\n", __FILE__, line, what, carom_last_message());
}

#define EXPECT(condition) expect(condition, #condition, __LINE__)
#define EXPECT_OK(call) expect((call) == CAROM_OK, #call, __LINE__)

static void refused_with(carom_status status, const char* word, const char* call, int line) {
  expect(status == CAROM_ERROR_ARGUMENT, call, line);
  expect(strstr(carom_last_message(), word) != NULL, word, line);
}

// Expects the call to return CAROM_ERROR_ARGUMENT with a message that contains the word.
#define EXPECT_REFUSED(call, word) refused_with(call, word, #call, __LINE__)

enum { BALL = 3, BLOCK = 4, FRAMES = 9600 };

// Returns a sound with one microphone above the origin, on the clock of the simulation.
static carom_sound* make_sound(const carom_settings* wanted, double height) {
  carom_listener listener;
  carom_settings settings;
  carom_sound* sound = NULL;
  EXPECT_OK(carom_listener_init(&listener, sizeof listener));
  listener.position[1] = height;
  EXPECT_OK(carom_settings_init(&settings, sizeof settings));
  if (wanted != NULL) settings = *wanted;
  settings.listeners = &listener;
  settings.listener_count = 1;
  settings.clock = CAROM_CLOCK_SIMULATION;
  EXPECT_OK(carom_create(&settings, &sound));
  if (sound == NULL) exit(1);
  return sound;
}

static void set_strike_bodies(carom_sound* sound) {
  carom_body body;
  EXPECT_OK(carom_body_init(&body, sizeof body));
  body.material = "wood";
  EXPECT_OK(carom_set_body(sound, BLOCK, &body));
  body.material = "steel";
  body.mass = STRIKE_MASS;
  body.radius = STRIKE_RADIUS;
  EXPECT_OK(carom_set_body(sound, BALL, &body));
}

static carom_event strike(void) {
  carom_event event;
  EXPECT_OK(carom_event_init(&event, sizeof event));
  event.time = STRIKE_TIME;
  event.body = BALL;
  event.other = BLOCK;
  event.impulse[1] = (1.0 + STRIKE_RESTITUTION) * STRIKE_MASS * STRIKE_SPEED;
  event.position[1] = -STRIKE_RADIUS;
  event.normal[0] = 0.0;
  event.normal[1] = 1.0;
  event.approach_speed = STRIKE_SPEED;
  event.effective_mass = STRIKE_MASS;
  event.radius = STRIKE_RADIUS;
  event.body_velocity[1] = -STRIKE_SPEED;
  return event;
}

// Renders FRAMES that are ready, in blocks of 480, while allocation is forbidden.
static void pull(carom_sound* sound, float* samples) {
  EXPECT(carom_frames_ready(sound) >= FRAMES);
  for (size_t frame = 0; frame < FRAMES; frame += 480) {
    float* channel = samples + frame;
    carom_status status = CAROM_OK;
    support_fail_after(0);  // an allocation would end the program: rendering is noexcept
    status = carom_render(sound, &channel, 1, 480);
    support_fail_after(-1);
    EXPECT_OK(status);
  }
}

// Renders the strike from the first sample on.
static void render_strike(carom_sound* sound, float* samples) {
  const carom_event event = strike();
  set_strike_bodies(sound);
  EXPECT_OK(carom_prepare_rendering(sound, STRIKE_SAMPLE_RATE));
  EXPECT_OK(carom_advance(sound, 0.0));
  EXPECT_OK(carom_post(sound, &event));
  EXPECT_OK(carom_advance(sound, 0.5));
  pull(sound, samples);
}

static float peak_of(const float* samples, size_t count) {
  float peak = 0.0F;
  for (size_t index = 0; index < count; ++index)
    peak = fmaxf(peak, fabsf(samples[index]));
  return peak;
}

static size_t first_above(const float* samples, size_t count, float level) {
  size_t index = 0;
  while (index < count && fabsf(samples[index]) < level)
    ++index;
  return index;
}

static carom_statistics statistics_of(const carom_sound* sound) {
  carom_statistics statistics;
  memset(&statistics, 0, sizeof statistics);
  statistics.size = sizeof statistics;
  EXPECT_OK(carom_get_statistics(sound, &statistics));
  return statistics;
}

static void library_has_the_version_of_its_header(void) {
  EXPECT(carom_version() == CAROM_VERSION);
  EXPECT(CAROM_VERSION ==
         10000 * CAROM_VERSION_MAJOR + 100 * CAROM_VERSION_MINOR + CAROM_VERSION_PATCH);
  EXPECT(carom_bullet_scalar_size() == 4 || carom_bullet_scalar_size() == 8);
}

static void every_status_has_a_text_of_its_own(void) {
  for (carom_status status = CAROM_OK; status <= CAROM_ERROR_INTERNAL + 1; ++status) {
    EXPECT(strlen(carom_status_text(status)) > 0);
    for (carom_status other = CAROM_OK; other < status; ++other)
      EXPECT(strcmp(carom_status_text(status), carom_status_text(other)) != 0);
  }
  EXPECT(strcmp(carom_status_text(-1), carom_status_text(99)) == 0);
}

static void materials_are_found_by_index_and_by_name(void) {
  EXPECT(carom_material_count() >= 8);
  for (size_t index = 0; index < carom_material_count(); ++index) {
    carom_material by_index;
    carom_material by_name;
    by_index.size = sizeof by_index;
    by_name.size = sizeof by_name;
    EXPECT_OK(carom_material_at(index, &by_index));
    EXPECT_OK(carom_find_material(by_index.name, &by_name));
    EXPECT(by_name.density == by_index.density && by_name.density > 0.0);
  }
}

// The values are from Chadwick, Zheng, James 2012, table of materials.
static void steel_is_that_of_the_paper(void) {
  carom_material steel;
  steel.size = sizeof steel;
  EXPECT_OK(carom_find_material("steel", &steel));
  EXPECT(strcmp(steel.name, "steel") == 0);
  EXPECT(steel.density == 8940.0);
  EXPECT(steel.youngs_modulus == 123.4e9);
  EXPECT(steel.poissons_ratio == 0.34);
}

// The wave front leaves the ball's surface, and the sound of a contact of 50 us rises within a few
// samples.
static void click_begins_when_sound_has_come_from_the_ball(void) {
  static float samples[FRAMES];
  carom_sound* const sound = make_sound(NULL, STRIKE_HEIGHT);
  const double heard = STRIKE_TIME + (STRIKE_HEIGHT - STRIKE_RADIUS) / 343.0;
  double begin = 0.0;
  render_strike(sound, samples);
  begin = (double)first_above(samples, FRAMES, 0.05F * peak_of(samples, FRAMES));
  EXPECT(peak_of(samples, FRAMES) > 0.01F);
  EXPECT(fabs(begin - heard * STRIKE_SAMPLE_RATE) < 3.0);
  EXPECT_OK(carom_destroy(sound));
}

static void samples_are_those_of_synth_bit_for_bit(void) {
  static float samples[FRAMES];
  static float expected[FRAMES];
  carom_sound* const sound = make_sound(NULL, STRIKE_HEIGHT);
  render_strike(sound, samples);
  support_render_strike(expected, FRAMES);
  EXPECT(memcmp(samples, expected, sizeof samples) == 0);
  EXPECT_OK(carom_destroy(sound));
}

// Renders two microphones at different places, planar and interleaved.
static void interleaved_samples_are_the_planar_ones(void) {
  static float planar[2][480];
  static float interleaved[2 * 480];
  float* const channels[2] = {planar[0], planar[1]};
  carom_sound* sounds[2] = {NULL, NULL};
  carom_settings settings;
  EXPECT_OK(carom_settings_init(&settings, sizeof settings));
  settings.clock = CAROM_CLOCK_SIMULATION;
  for (int which = 0; which < 2; ++which) {
    const carom_event event = strike();
    EXPECT_OK(carom_create(&settings, &sounds[which]));
    set_strike_bodies(sounds[which]);
    EXPECT_OK(carom_prepare_rendering(sounds[which], STRIKE_SAMPLE_RATE));
    EXPECT_OK(carom_advance(sounds[which], 0.0));
    EXPECT_OK(carom_post(sounds[which], &event));
    EXPECT_OK(carom_advance(sounds[which], 0.5));
    EXPECT(carom_channel_count(sounds[which]) == 2);
  }
  for (size_t block = 0; block < 20; ++block) {
    EXPECT_OK(carom_render(sounds[0], channels, 2, 480));
    EXPECT_OK(carom_render_interleaved(sounds[1], interleaved, 2, 480));
    for (size_t frame = 0; frame < 480; ++frame) {
      EXPECT(planar[0][frame] == interleaved[2 * frame]);
      EXPECT(planar[1][frame] == interleaved[2 * frame + 1]);
    }
  }
  EXPECT(statistics_of(sounds[0]).events == 1);
  EXPECT_OK(carom_destroy(sounds[0]));
  EXPECT_OK(carom_destroy(sounds[1]));
}

// A material so soft that its contact lasts longer than sound takes to pass the ball.
static carom_material foam(void) {
  carom_material material;
  memset(&material, 0, sizeof material);
  material.size = sizeof material;
  material.density = 1000.0;
  material.youngs_modulus = 1e6;
  material.poissons_ratio = 0.4;
  material.restitution = 0.5;
  return material;
}

static float peak_of_foam(carom_body body) {
  static float samples[FRAMES];
  const carom_material material = foam();
  carom_sound* const sound = make_sound(NULL, 1.0);
  carom_event event = strike();
  carom_body block;
  EXPECT_OK(carom_body_init(&block, sizeof block));
  block.own_material = &material;
  body.own_material = &material;
  body.mass = STRIKE_MASS;
  EXPECT_OK(carom_set_body(sound, BLOCK, &block));
  EXPECT_OK(carom_set_body(sound, BALL, &body));
  EXPECT_OK(carom_prepare_rendering(sound, STRIKE_SAMPLE_RATE));
  EXPECT_OK(carom_advance(sound, 0.0));
  EXPECT_OK(carom_post(sound, &event));
  EXPECT_OK(carom_advance(sound, 0.5));
  pull(sound, samples);
  EXPECT(statistics_of(sound).events == 1);
  EXPECT_OK(carom_destroy(sound));
  return peak_of(samples, FRAMES);
}

// At wavelengths far larger than a cube of edge a it sounds as the sphere whose dipole 2 pi R^3 is
// a^3 (1 + 0.638), as it drags along 0.638 of its volume of air. Tested as a box and as a mesh.
static void cube_sounds_as_the_sphere_that_moves_as_much_air(void) {
  const double half = 0.005;
  const double corners[24] = {-half, -half, -half, half,  -half, -half, -half, half,
                              -half, half,  half,  -half, -half, -half, half,  half,
                              -half, half,  -half, half,  half,  half,  half,  half};
  const uint32_t triangles[36] = {0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5, 0, 1, 5, 0, 5, 4,
                                  2, 6, 7, 2, 7, 3, 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6};
  carom_body box;
  carom_body mesh;
  carom_body sphere;
  double of_sphere = 0.0;
  EXPECT_OK(carom_body_init(&box, sizeof box));
  mesh = box;
  sphere = box;
  box.shape = CAROM_SHAPE_BOX;
  box.half_extents[0] = box.half_extents[1] = box.half_extents[2] = half;
  mesh.shape = CAROM_SHAPE_MESH;
  mesh.vertices = corners;
  mesh.vertex_count = 8;
  mesh.triangles = triangles;
  mesh.triangle_count = 12;
  sphere.radius = cbrt(8.0 * half * half * half * 1.638 / (2.0 * acos(-1.0)));
  of_sphere = (double)peak_of_foam(sphere);
  EXPECT(of_sphere > 0.0);
  EXPECT(fabs((double)peak_of_foam(box) / of_sphere - 1.0) < 0.01);
  EXPECT(fabs((double)peak_of_foam(mesh) / of_sphere - 1.0) < 0.01);
}

static uint32_t number_at(const unsigned char* bytes) {
  return (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 |
         (uint32_t)bytes[3] << 24;
}

// Reads the samples of a WAV file of 32-bit floats; returns their count, at most `room`, or 0 if it
// is no such file.
static size_t read_wav(const char* path, float* samples, size_t room) {
  unsigned char head[12];
  unsigned char chunk[8];
  size_t count = 0;
  FILE* const file = fopen(path, "rb");
  if (file == NULL) return 0;
  if (fread(head, 1, 12, file) == 12 && memcmp(head, "RIFF", 4) == 0) {
    while (count == 0 && fread(chunk, 1, 8, file) == 8) {
      const uint32_t size = number_at(chunk + 4);
      if (memcmp(chunk, "data", 4) == 0)
        count = fread(samples, 4, size / 4 < room ? size / 4 : room, file);
      else if (fseek(file, (long)(size + size % 2), SEEK_CUR) != 0)
        break;
    }
  }
  EXPECT(fclose(file) == 0);
  return count;
}

static void recording_holds_the_pascals_of_synth_over_20(void) {
  const char* const path = "c_api_recording.wav";
  static float expected[FRAMES];
  static float recorded[2 * 48000];
  carom_sound* const sound = make_sound(NULL, STRIKE_HEIGHT);
  const carom_event event = strike();
  size_t count = 0;
  (void)remove(path);
  set_strike_bodies(sound);
  EXPECT_OK(carom_record(sound, path));
  EXPECT(carom_record(sound, path) == CAROM_ERROR_FILE);
  EXPECT_OK(carom_advance(sound, 0.0));
  EXPECT_OK(carom_post(sound, &event));
  EXPECT_OK(carom_advance(sound, 0.3));
  EXPECT(read_wav(path, recorded, 1) == 0);
  EXPECT_OK(carom_finish_recording(sound));
  EXPECT_OK(carom_finish_recording(sound));
  EXPECT(statistics_of(sound).events == 1);
  count = read_wav(path, recorded, sizeof recorded / sizeof recorded[0]);
  EXPECT(count >= FRAMES);
  support_render_strike(expected, FRAMES);
  for (size_t frame = 0; frame < FRAMES; ++frame)
    EXPECT(fabsf(20.0F * recorded[frame] - expected[frame]) <= 1e-6F * fabsf(expected[frame]));
  EXPECT_OK(carom_destroy(sound));
}

static void destroying_completes_a_recording(void) {
  const char* const path = "c_api_destroyed.wav";
  static float recorded[48000];
  carom_sound* const sound = make_sound(NULL, STRIKE_HEIGHT);
  const carom_event event = strike();
  set_strike_bodies(sound);
  (void)remove(path);
  EXPECT_OK(carom_record(sound, path));
  EXPECT_OK(carom_advance(sound, 0.0));
  EXPECT_OK(carom_post(sound, &event));
  EXPECT_OK(carom_advance(sound, 0.3));
  EXPECT_OK(carom_destroy(sound));
  EXPECT(peak_of(recorded, read_wav(path, recorded, 48000)) > 0.0F);
}

static void file_that_cannot_be_is_refused(void) {
  carom_sound* const sound = make_sound(NULL, STRIKE_HEIGHT);
  EXPECT(carom_record(sound, "no/such/folder/sound.wav") == CAROM_ERROR_FILE);
  EXPECT(strstr(carom_last_message(), "no/such/folder") != NULL);
  EXPECT_REFUSED(carom_record(sound, NULL), "NULL");
  EXPECT_OK(carom_destroy(sound));
}

static void full_scale_divides_pascals(void) {
  static float samples[FRAMES];
  static float pascals[FRAMES];
  carom_settings settings;
  carom_sound* sound = NULL;
  EXPECT_OK(carom_settings_init(&settings, sizeof settings));
  settings.full_scale = 8.0;
  sound = make_sound(&settings, STRIKE_HEIGHT);
  render_strike(sound, samples);
  support_render_strike(pascals, FRAMES);
  for (size_t frame = 0; frame < FRAMES; ++frame)
    EXPECT(8.0F * samples[frame] == pascals[frame]);
  EXPECT_OK(carom_destroy(sound));
}

static void limiter_keeps_its_ceiling(void) {
  static float samples[FRAMES];
  carom_settings settings;
  carom_sound* sound = NULL;
  EXPECT_OK(carom_settings_init(&settings, sizeof settings));
  settings.full_scale = 0.001;
  settings.limiter = 1;
  settings.limiter_ceiling = 0.5;
  sound = make_sound(&settings, STRIKE_HEIGHT);
  render_strike(sound, samples);
  EXPECT(peak_of(samples, FRAMES) <= 0.5F);
  EXPECT(peak_of(samples, FRAMES) > 0.49F);
  EXPECT(carom_output_delay(sound) > 0);
  EXPECT(statistics_of(sound).gain_reduction > 20.0);
  EXPECT_OK(carom_destroy(sound));
}

static void gain_and_mute_act_on_what_is_rendered(void) {
  static float samples[FRAMES];
  static float pascals[FRAMES];
  carom_sound* sound = make_sound(NULL, STRIKE_HEIGHT);
  EXPECT_OK(carom_set_gain(sound, 2.0));
  render_strike(sound, samples);
  support_render_strike(pascals, FRAMES);
  for (size_t frame = 0; frame < FRAMES; ++frame)
    EXPECT(samples[frame] == 2.0F * pascals[frame]);
  EXPECT_OK(carom_destroy(sound));

  sound = make_sound(NULL, STRIKE_HEIGHT);
  EXPECT_OK(carom_set_muted(sound, 1));
  render_strike(sound, samples);
  EXPECT(peak_of(samples, FRAMES) == 0.0F);
  EXPECT(statistics_of(sound).events == 1);
  EXPECT_OK(carom_destroy(sound));
}

#if CAROM_TEST_DEVICE
static void device_is_played_and_let_go(void) {
  carom_sound* const sound = make_sound(NULL, STRIKE_HEIGHT);
  support_set_audio_driver("dummy");
  EXPECT_OK(carom_play(sound));
  EXPECT(carom_sample_rate(sound) >= 8000.0);
  EXPECT_OK(carom_stop(sound));
  EXPECT_OK(carom_prepare_rendering(sound, STRIKE_SAMPLE_RATE));
  EXPECT(carom_play(sound) == CAROM_ERROR_DEVICE);  // the host pulls the samples
  EXPECT_OK(carom_destroy(sound));
}
#endif

static void device_that_is_not_there_is_refused(void) {
  static float samples[FRAMES];
  static float expected[FRAMES];
  carom_sound* const sound = make_sound(NULL, STRIKE_HEIGHT);
  support_set_audio_driver("no such driver");
  EXPECT(carom_play(sound) == CAROM_ERROR_DEVICE);
  EXPECT(strlen(carom_last_message()) > 0);
  render_strike(sound, samples);
  support_render_strike(expected, FRAMES);
  EXPECT(memcmp(samples, expected, sizeof samples) == 0);
  EXPECT_OK(carom_destroy(sound));
}

// At twice the distance from the ball's centre the strike is half as loud, but for the near field.
static void listener_is_heard_where_it_was_put(void) {
  static float samples[FRAMES];
  static float nearer[FRAMES];
  const double place[3] = {0.0, 2.0 * STRIKE_HEIGHT, 0.0};
  carom_sound* const sound = make_sound(NULL, STRIKE_HEIGHT);
  EXPECT_OK(carom_set_listener(sound, 0, place, NULL));
  render_strike(sound, samples);
  support_render_strike(nearer, FRAMES);
  EXPECT(fabsf(2.0F * peak_of(samples, FRAMES) / peak_of(nearer, FRAMES) - 1.0F) < 0.03F);
  EXPECT_OK(carom_destroy(sound));
}

static void events_are_counted_by_what_became_of_them(void) {
  carom_sound* const sound = make_sound(NULL, STRIKE_HEIGHT);
  carom_event event = strike();
  static float samples[FRAMES];
  carom_statistics counted;
  set_strike_bodies(sound);
  EXPECT_OK(carom_prepare_rendering(sound, STRIKE_SAMPLE_RATE));
  EXPECT_OK(carom_advance(sound, 0.0));
  EXPECT_OK(carom_post(sound, &event));
  event.body = BLOCK;
  event.other = BALL;
  EXPECT_OK(carom_post(sound, &event));  // the body is immovable
  event.body = 99;
  EXPECT_OK(carom_post(sound, &event));  // the body is unknown
  event = strike();
  event.position[0] = NAN;
  EXPECT_OK(carom_post(sound, &event));  // the place is not finite
  event = strike();
  event.approach_speed = -1.0;
  EXPECT_OK(carom_post(sound, &event));  // the bodies separate
  event = strike();
  event.impulse[1] *= 1e-9;
  EXPECT_OK(carom_post(sound, &event));  // the strike is inaudible
  EXPECT_OK(carom_advance(sound, 0.5));
  pull(sound, samples);
  counted = statistics_of(sound);
  EXPECT(counted.events == 2);
  EXPECT(counted.immovable == 1);
  EXPECT(counted.rejected == 3);
  EXPECT(counted.inaudible == 1);
  EXPECT(counted.late == 0);
  EXPECT_OK(carom_remove_body(sound, BALL));
  event = strike();
  event.time = 0.6;
  EXPECT_OK(carom_post(sound, &event));  // the body is unknown by now
  EXPECT_OK(carom_advance(sound, 1.0));
  pull(sound, samples);
  EXPECT(statistics_of(sound).rejected == 4);
  EXPECT_OK(carom_destroy(sound));
}

// The ball falls 0.2 m and is heard from 0.5 m above the floor.
static void ball_of_a_bullet_world_is_heard_when_it_lands(void) {
  static float samples[24000];
  support_world* const world = support_world_make();
  carom_listener listener;
  carom_settings settings;
  carom_sound* sound = NULL;
  float* channel = samples;
  const double lands = sqrt(2.0 * 0.2 / 9.81);
  const double heard = lands + (0.5 - 2.0 * 0.01) / 343.0;
  double begin = 0.0;
  EXPECT_OK(carom_listener_init(&listener, sizeof listener));
  listener.position[1] = 0.5;
  EXPECT_OK(carom_settings_init(&settings, sizeof settings));
  settings.listeners = &listener;
  settings.listener_count = 1;
  settings.clock = CAROM_CLOCK_SIMULATION;
  EXPECT_OK(carom_attach(support_world_bullet(world), &settings, &sound));
  EXPECT_OK(carom_set_object_material(sound, support_world_ball(world), "glass"));
  EXPECT_OK(carom_prepare_rendering(sound, STRIKE_SAMPLE_RATE));
  support_world_step(world, 0.6);
  EXPECT(fabs(carom_time(sound) - 0.6) < 1e-6);
  EXPECT(carom_frames_ready(sound) >= 24000);
  EXPECT_OK(carom_render(sound, &channel, 1, 24000));
  begin = (double)first_above(samples, 24000, 0.05F * peak_of(samples, 24000)) / STRIKE_SAMPLE_RATE;
  // Bullet's Euler steps differ from the parabola by half a substep times g t.
  EXPECT(fabs(begin - heard) < 2.5e-3);
  // The second landing comes 2 * 0.8 falls after the first, at 0.53 s; the third would come at 0.78
  // s.
  EXPECT(statistics_of(sound).events == 2);
  EXPECT(statistics_of(sound).unsupported_contacts == 0);
  EXPECT_OK(carom_destroy(sound));
  support_world_step(world, 0.1);
  support_world_free(world);
}

static void materials_are_set_by_object_shape_and_user_index(void) {
  support_world* const world = support_world_make();
  const btCollisionObject* const ball = support_world_ball(world);
  const btCollisionShape* const shape = support_world_shape(world);
  carom_material own = foam();
  carom_sound* sound = NULL;
  EXPECT_OK(carom_attach(support_world_bullet(world), NULL, &sound));
  EXPECT_OK(carom_set_object_material(sound, ball, "steel"));
  EXPECT_OK(carom_set_shape_material(sound, shape, "glass"));
  EXPECT_OK(carom_set_user_index_material(sound, 7, "wood"));
  EXPECT_OK(carom_set_object_own_material(sound, ball, &own));
  EXPECT_OK(carom_set_shape_own_material(sound, shape, &own));
  EXPECT_OK(carom_set_user_index_own_material(sound, 7, &own));
  EXPECT_OK(carom_prepare_bodies(sound));

  EXPECT_REFUSED(carom_set_object_material(sound, ball, "cheese"), "cheese");
  EXPECT(strstr(carom_last_message(), "aluminium") != NULL);
  EXPECT_REFUSED(carom_set_shape_material(sound, shape, NULL), "NULL");
  EXPECT_REFUSED(carom_set_object_material(sound, NULL, "steel"), "NULL");
  EXPECT_REFUSED(carom_set_shape_material(sound, NULL, "steel"), "NULL");
  EXPECT_REFUSED(carom_set_object_own_material(sound, ball, NULL), "NULL");
  EXPECT(carom_set_object_material(sound, support_world_absent(world), "steel") ==
         CAROM_ERROR_ARGUMENT);
  own.density = -1.0;
  EXPECT_REFUSED(carom_set_user_index_own_material(sound, 7, &own), "density");
  own.size = 3;
  EXPECT_REFUSED(carom_set_shape_own_material(sound, shape, &own), "carom_material.size is 3");
  EXPECT_OK(carom_destroy(sound));
  support_world_free(world);
}

static const char* const modes_path = "c_api.carom_modes";

// Loads a model of one mode.
static carom_modes* load(double frequency, double decay_rate) {
  carom_modes* modes = NULL;
  support_write_modes(modes_path, frequency, decay_rate);
  EXPECT_OK(carom_load_modes(modes_path, &modes));
  if (modes == NULL) exit(1);
  return modes;
}

static void modes_are_those_of_the_file(void) {
  carom_modes* const modes = load(440.5, 3.25);
  double frequency = 0.0;
  double decay_rate = 0.0;
  EXPECT(carom_mode_count(modes) == 1);
  EXPECT_OK(carom_mode_at(modes, 0, &frequency, &decay_rate));
  EXPECT(frequency == 440.5 && decay_rate == 3.25);
  EXPECT_OK(carom_mode_at(modes, 0, NULL, NULL));
  EXPECT_REFUSED(carom_mode_at(modes, 1, &frequency, NULL), "there is no mode 1; there are 1");
  EXPECT_REFUSED(carom_mode_at(NULL, 0, &frequency, NULL), "carom_modes is NULL");
  EXPECT(frequency == 440.5);
  EXPECT(carom_mode_count(NULL) == 0);
  carom_free_modes(modes);
  carom_free_modes(NULL);
}

static void modes_that_cannot_be_read_are_refused(void) {
  carom_modes* modes = load(440.0, 1.0);
  FILE* file = NULL;
  carom_free_modes(modes);
  EXPECT(carom_load_modes("no/such/folder/gong.carom_modes", &modes) == CAROM_ERROR_FILE);
  EXPECT(strstr(carom_last_message(), "no/such/folder/gong") != NULL);
  EXPECT(modes == NULL);
  file = fopen(modes_path, "ab");
  EXPECT(file != NULL && fputc('x', file) == 'x' && fclose(file) == 0);
  EXPECT(carom_load_modes(modes_path, &modes) == CAROM_ERROR_FILE);
  EXPECT(strstr(carom_last_message(), modes_path) != NULL);
  EXPECT_REFUSED(carom_load_modes(NULL, &modes), "NULL");
  EXPECT_REFUSED(carom_load_modes(modes_path, NULL), "NULL");
}

// The mode of 1 kHz decays at 20/s, which is exp(-1.6) in 80 ms. The host frees the modes before
// the first sample.
static void struck_body_rings_at_its_frequency_and_falls_at_its_rate(void) {
  static float samples[FRAMES];
  carom_sound* const sound = make_sound(NULL, STRIKE_HEIGHT);
  carom_modes* const modes = load(1000.0, 20.0);
  const carom_event event = strike();
  const size_t early = 5200;  // 6 ms after the click has arrived
  const size_t later = early + 3840;
  int crossings = 0;
  set_strike_bodies(sound);
  EXPECT_OK(carom_set_body_modes(sound, BALL, modes));
  carom_free_modes(modes);
  EXPECT_OK(carom_prepare_rendering(sound, STRIKE_SAMPLE_RATE));
  EXPECT_OK(carom_advance(sound, 0.0));
  EXPECT_OK(carom_post(sound, &event));
  EXPECT_OK(carom_advance(sound, 0.5));
  pull(sound, samples);
  for (size_t index = early; index < later; ++index)
    crossings += (samples[index] < 0.0F) != (samples[index + 1] < 0.0F);
  EXPECT(abs(crossings - 160) <= 1);
  EXPECT(fabs((double)(peak_of(samples + later, 480) / peak_of(samples + early, 480)) - exp(-1.6)) <
         0.002);
  EXPECT(statistics_of(sound).rings == 1);
  EXPECT(statistics_of(sound).ringing == 1);
  EXPECT(statistics_of(sound).modes >= 1);
  EXPECT(statistics_of(sound).modal_voices_exhausted == 0);
  EXPECT_OK(carom_destroy(sound));
}

// Strikes once more; returns how many of the strikes so far made a body ring.
static uint64_t rings_with_a_strike_at(carom_sound* sound, double time) {
  static float samples[FRAMES];
  carom_event event = strike();
  event.time = time;
  EXPECT_OK(carom_post(sound, &event));
  EXPECT_OK(carom_advance(sound, time + 0.25));
  pull(sound, samples);
  return statistics_of(sound).rings;
}

static void modes_stay_with_a_body_until_it_is_removed(void) {
  carom_sound* const sound = make_sound(NULL, STRIKE_HEIGHT);
  carom_modes* const modes = load(1000.0, 20.0);
  EXPECT_REFUSED(carom_set_body_modes(sound, BALL, modes), "carom_set_body comes first");
  set_strike_bodies(sound);
  EXPECT_OK(carom_prepare_rendering(sound, STRIKE_SAMPLE_RATE));
  EXPECT_OK(carom_advance(sound, 0.0));
  EXPECT(rings_with_a_strike_at(sound, 0.1) == 0);
  EXPECT_OK(carom_set_body_modes(sound, BALL, modes));
  EXPECT(rings_with_a_strike_at(sound, 0.6) == 1);
  set_strike_bodies(sound);
  EXPECT(rings_with_a_strike_at(sound, 1.1) == 2);
  EXPECT_OK(carom_set_body_modes(sound, BALL, NULL));
  EXPECT(rings_with_a_strike_at(sound, 1.6) == 2);
  EXPECT_OK(carom_set_body_modes(sound, BALL, modes));
  EXPECT_OK(carom_remove_body(sound, BALL));
  EXPECT_REFUSED(carom_set_body_modes(sound, BALL, modes), "carom_set_body comes first");
  set_strike_bodies(sound);
  EXPECT(rings_with_a_strike_at(sound, 2.1) == 2);
  carom_free_modes(modes);
  EXPECT_OK(carom_destroy(sound));
}

enum { BY_OBJECT = 1, BY_SHAPE = 2, BY_USER_INDEX = 4, NOT_BY_OBJECT = 8 };

// True if the ball of the Bullet world rings when it lands.
static int rings_in_bullet(int ways) {
  static float samples[24000];
  float* channel = samples;
  support_world* const world = support_world_make();
  carom_modes* const modes = load(1000.0, 20.0);
  carom_settings settings;
  carom_listener listener;
  carom_sound* sound = NULL;
  uint64_t rings = 0;
  EXPECT_OK(carom_listener_init(&listener, sizeof listener));
  EXPECT_OK(carom_settings_init(&settings, sizeof settings));
  listener.position[1] = 0.5;
  settings.listeners = &listener;
  settings.listener_count = 1;
  settings.clock = CAROM_CLOCK_SIMULATION;
  EXPECT_OK(carom_attach(support_world_bullet(world), &settings, &sound));
  if (ways & BY_USER_INDEX) EXPECT_OK(carom_set_user_index_modes(sound, 7, modes));
  if (ways & BY_SHAPE) EXPECT_OK(carom_set_shape_modes(sound, support_world_shape(world), modes));
  if (ways & BY_OBJECT) EXPECT_OK(carom_set_object_modes(sound, support_world_ball(world), modes));
  if (ways & NOT_BY_OBJECT)
    EXPECT_OK(carom_set_object_modes(sound, support_world_ball(world), NULL));
  carom_free_modes(modes);
  EXPECT_OK(carom_prepare_rendering(sound, STRIKE_SAMPLE_RATE));
  support_world_step(world, 0.6);
  EXPECT_OK(carom_render(sound, &channel, 1, 24000));
  EXPECT(statistics_of(sound).events == 2);
  rings = statistics_of(sound).rings;
  EXPECT(rings == 0 || rings == 2);
  EXPECT_OK(carom_destroy(sound));
  support_world_free(world);
  return rings > 0;
}

static void modes_are_set_by_object_shape_and_user_index(void) {
  EXPECT(!rings_in_bullet(0));
  EXPECT(rings_in_bullet(BY_OBJECT));
  EXPECT(rings_in_bullet(BY_SHAPE));
  EXPECT(rings_in_bullet(BY_USER_INDEX));
  EXPECT(!rings_in_bullet(BY_SHAPE | BY_USER_INDEX | NOT_BY_OBJECT));
}

static void modes_are_refused_for_what_is_not_there(void) {
  support_world* const world = support_world_make();
  carom_modes* const modes = load(1000.0, 20.0);
  carom_sound* sound = NULL;
  carom_sound* const of_events = make_sound(NULL, 1.0);
  EXPECT_OK(carom_attach(support_world_bullet(world), NULL, &sound));
  EXPECT_REFUSED(carom_set_object_modes(sound, NULL, modes), "NULL");
  EXPECT_REFUSED(carom_set_shape_modes(sound, NULL, modes), "NULL");
  EXPECT_REFUSED(carom_set_object_modes(sound, support_world_absent(world), modes),
                 "not in the world");
  EXPECT(carom_set_body_modes(sound, BALL, modes) == CAROM_ERROR_KIND);
  EXPECT(carom_set_object_modes(of_events, support_world_ball(world), modes) == CAROM_ERROR_KIND);
  EXPECT(carom_set_shape_modes(of_events, support_world_shape(world), modes) == CAROM_ERROR_KIND);
  EXPECT(carom_set_user_index_modes(of_events, 7, modes) == CAROM_ERROR_KIND);
  EXPECT_OK(carom_destroy(of_events));
  EXPECT_OK(carom_destroy(sound));
  carom_free_modes(modes);
  support_world_free(world);
}

static void calls_of_the_other_kind_of_sound_are_refused(void) {
  support_world* const world = support_world_make();
  const btCollisionObject* const ball = support_world_ball(world);
  const carom_event event = strike();
  carom_sound* of_world = NULL;
  carom_sound* const of_events = make_sound(NULL, 1.0);
  carom_body body;
  EXPECT_OK(carom_body_init(&body, sizeof body));
  EXPECT_OK(carom_attach(support_world_bullet(world), NULL, &of_world));
  EXPECT(carom_post(of_world, &event) == CAROM_ERROR_KIND);
  EXPECT(carom_advance(of_world, 1.0) == CAROM_ERROR_KIND);
  EXPECT(carom_set_body(of_world, 0, &body) == CAROM_ERROR_KIND);
  EXPECT(carom_remove_body(of_world, 0) == CAROM_ERROR_KIND);
  EXPECT(strstr(carom_last_message(), "carom_create") != NULL);
  EXPECT(carom_set_object_material(of_events, ball, "steel") == CAROM_ERROR_KIND);
  EXPECT(carom_set_user_index_material(of_events, 0, "steel") == CAROM_ERROR_KIND);
  EXPECT(carom_prepare_bodies(of_events) == CAROM_ERROR_KIND);
  EXPECT(strstr(carom_last_message(), "carom_attach") != NULL);
  EXPECT_OK(carom_destroy(of_world));
  EXPECT_OK(carom_destroy(of_events));
  support_world_free(world);
}

static void null_handle_is_refused_by_every_call(void) {
  const double place[3] = {0.0, 0.0, 0.0};
  float sample = 1.0F;
  float* channel = &sample;
  carom_statistics statistics;
  statistics.size = sizeof statistics;
  EXPECT_OK(carom_destroy(NULL));
  EXPECT_REFUSED(carom_set_body(NULL, 0, NULL), "carom_sound is NULL");
  EXPECT_REFUSED(carom_remove_body(NULL, 0), "carom_sound is NULL");
  EXPECT_REFUSED(carom_post(NULL, NULL), "carom_sound is NULL");
  EXPECT_REFUSED(carom_advance(NULL, 0.0), "carom_sound is NULL");
  EXPECT_REFUSED(carom_set_object_material(NULL, NULL, NULL), "carom_sound is NULL");
  EXPECT_REFUSED(carom_set_shape_material(NULL, NULL, NULL), "carom_sound is NULL");
  EXPECT_REFUSED(carom_set_user_index_material(NULL, 0, NULL), "carom_sound is NULL");
  EXPECT_REFUSED(carom_set_object_own_material(NULL, NULL, NULL), "carom_sound is NULL");
  EXPECT_REFUSED(carom_set_shape_own_material(NULL, NULL, NULL), "carom_sound is NULL");
  EXPECT_REFUSED(carom_set_user_index_own_material(NULL, 0, NULL), "carom_sound is NULL");
  EXPECT_REFUSED(carom_set_body_modes(NULL, 0, NULL), "carom_sound is NULL");
  EXPECT_REFUSED(carom_set_object_modes(NULL, NULL, NULL), "carom_sound is NULL");
  EXPECT_REFUSED(carom_set_shape_modes(NULL, NULL, NULL), "carom_sound is NULL");
  EXPECT_REFUSED(carom_set_user_index_modes(NULL, 0, NULL), "carom_sound is NULL");
  EXPECT_REFUSED(carom_prepare_bodies(NULL), "carom_sound is NULL");
  EXPECT_REFUSED(carom_set_listener(NULL, 0, place, NULL), "carom_sound is NULL");
  EXPECT_REFUSED(carom_pause(NULL), "carom_sound is NULL");
  EXPECT_REFUSED(carom_set_time_scale(NULL, 1.0), "carom_sound is NULL");
  EXPECT_REFUSED(carom_play(NULL), "carom_sound is NULL");
  EXPECT_REFUSED(carom_prepare_rendering(NULL, 48000.0), "carom_sound is NULL");
  EXPECT_REFUSED(carom_stop(NULL), "carom_sound is NULL");
  EXPECT_REFUSED(carom_record(NULL, "c_api_null.wav"), "carom_sound is NULL");
  EXPECT_REFUSED(carom_finish_recording(NULL), "carom_sound is NULL");
  EXPECT_REFUSED(carom_set_gain(NULL, 1.0), "carom_sound is NULL");
  EXPECT_REFUSED(carom_set_muted(NULL, 1), "carom_sound is NULL");
  EXPECT_REFUSED(carom_get_statistics(NULL, &statistics), "carom_sound is NULL");
  EXPECT(carom_render(NULL, &channel, 1, 1) == CAROM_ERROR_ARGUMENT);
  EXPECT(carom_render_interleaved(NULL, channel, 1, 1) == CAROM_ERROR_ARGUMENT);
  EXPECT(sample == 1.0F);
  EXPECT(carom_time(NULL) == 0.0 && carom_sample_rate(NULL) == 0.0);
  EXPECT(carom_channel_count(NULL) == 0 && carom_frames_ready(NULL) == 0);
  EXPECT(carom_output_delay(NULL) == 0);
}

static void null_arguments_are_refused(void) {
  carom_sound* sound = make_sound(NULL, 1.0);
  carom_sound* none = sound;
  carom_material steel;
  float sample = 1.0F;
  float* channels[1] = {NULL};
  steel.size = sizeof steel;
  EXPECT_REFUSED(carom_create(NULL, NULL), "NULL");
  EXPECT_REFUSED(carom_attach(NULL, NULL, &none), "btDynamicsWorld is NULL");
  EXPECT(none == NULL);
  EXPECT_REFUSED(carom_settings_init(NULL, sizeof(carom_settings)), "carom_settings is NULL");
  EXPECT_REFUSED(carom_listener_init(NULL, sizeof(carom_listener)), "carom_listener is NULL");
  EXPECT_REFUSED(carom_body_init(NULL, sizeof(carom_body)), "carom_body is NULL");
  EXPECT_REFUSED(carom_event_init(NULL, sizeof(carom_event)), "carom_event is NULL");
  EXPECT_REFUSED(carom_material_at(0, NULL), "carom_material is NULL");
  EXPECT_REFUSED(carom_find_material("steel", NULL), "carom_material is NULL");
  EXPECT_REFUSED(carom_find_material(NULL, &steel), "NULL");
  EXPECT_REFUSED(carom_set_body(sound, 0, NULL), "carom_body is NULL");
  EXPECT_REFUSED(carom_post(sound, NULL), "carom_event is NULL");
  EXPECT_REFUSED(carom_set_listener(sound, 0, NULL, NULL), "NULL");
  EXPECT_REFUSED(carom_get_statistics(sound, NULL), "carom_statistics is NULL");
  EXPECT(carom_render(sound, NULL, 1, 1) == CAROM_ERROR_ARGUMENT);
  EXPECT(carom_render(sound, channels, 1, 1) == CAROM_ERROR_ARGUMENT);
  EXPECT(carom_render_interleaved(sound, NULL, 1, 1) == CAROM_ERROR_ARGUMENT);
  channels[0] = &sample;
  EXPECT(carom_render(sound, channels, 2, 1) == CAROM_ERROR_ARGUMENT);
  EXPECT(carom_render_interleaved(sound, &sample, 0, 1) == CAROM_ERROR_ARGUMENT);
  EXPECT(sample == 1.0F);
  EXPECT_OK(carom_render(sound, channels, 1, 1));
  EXPECT(sample == 0.0F);
  EXPECT_OK(carom_destroy(sound));
}

static void numbers_out_of_range_are_refused(void) {
  carom_sound* const sound = make_sound(NULL, 1.0);
  const double place[3] = {0.0, 0.0, NAN};
  const double origin[3] = {0.0, 0.0, 0.0};
  const double turn[4] = {0.0, 0.0, 0.0, 2.0};
  carom_material material;
  material.size = sizeof material;
  EXPECT_REFUSED(carom_advance(sound, NAN), "at most 1e9");
  EXPECT_REFUSED(carom_advance(sound, INFINITY), "at most 1e9");
  EXPECT_REFUSED(carom_advance(sound, 1e18), "at most 1e9");
  EXPECT(carom_time(sound) == 0.0);
  EXPECT_REFUSED(carom_set_gain(sound, -0.1), "gain");
  EXPECT_REFUSED(carom_set_gain(sound, NAN), "gain");
  EXPECT_REFUSED(carom_set_gain(sound, 1001.0), "1000");
  EXPECT(carom_set_time_scale(sound, 0.0) == CAROM_ERROR_ARGUMENT);
  EXPECT(carom_set_time_scale(sound, NAN) == CAROM_ERROR_ARGUMENT);
  EXPECT(carom_prepare_rendering(sound, 7999.0) == CAROM_ERROR_ARGUMENT);
  EXPECT(carom_prepare_rendering(sound, NAN) == CAROM_ERROR_ARGUMENT);
  EXPECT(carom_set_listener(sound, 0, place, NULL) == CAROM_ERROR_ARGUMENT);
  EXPECT(carom_set_listener(sound, 0, origin, turn) == CAROM_ERROR_ARGUMENT);
  EXPECT(carom_set_listener(sound, 1, origin, NULL) == CAROM_ERROR_ARGUMENT);
  EXPECT_REFUSED(carom_material_at(carom_material_count(), &material), "there is no material");
  EXPECT_REFUSED(carom_find_material("", &material), "there is no material ''");
  EXPECT_OK(carom_destroy(sound));
}

static carom_status create_with(const carom_settings* settings) {
  carom_sound* sound = NULL;
  const carom_status status = carom_create(settings, &sound);
  EXPECT((status == CAROM_OK) == (sound != NULL));
  (void)carom_destroy(sound);
  return status;
}

static carom_settings defaults(void) {
  carom_settings settings;
  EXPECT_OK(carom_settings_init(&settings, sizeof settings));
  return settings;
}

static void settings_out_of_range_are_refused(void) {
  carom_settings settings = defaults();
  EXPECT_OK(create_with(&settings));
  settings.sample_rate = NAN;
  EXPECT(create_with(&settings) == CAROM_ERROR_ARGUMENT);
  settings = defaults();
  settings.latency = -1.0;
  EXPECT(create_with(&settings) == CAROM_ERROR_ARGUMENT);
  settings = defaults();
  settings.voices = 0;
  EXPECT(create_with(&settings) == CAROM_ERROR_ARGUMENT);
  settings = defaults();
  settings.ringing_bodies = 0;
  EXPECT_REFUSED(create_with(&settings), "ringing bodies");
  settings = defaults();
  settings.modes = 4097;
  EXPECT_REFUSED(create_with(&settings), "modes");
  settings = defaults();
  settings.cpu_share = NAN;
  EXPECT(create_with(&settings) == CAROM_ERROR_ARGUMENT);
  settings = defaults();
  settings.full_scale = -2.0;
  EXPECT(create_with(&settings) == CAROM_ERROR_ARGUMENT);
  settings = defaults();
  settings.speed_of_sound = 0.0;
  EXPECT(create_with(&settings) == CAROM_ERROR_ARGUMENT);
  settings = defaults();
  settings.clock = 2;
  EXPECT_REFUSED(create_with(&settings), "carom_settings.clock is 2");
  settings = defaults();
  settings.limiter = -1;
  EXPECT_REFUSED(create_with(&settings), "carom_settings.limiter is -1");
  settings = defaults();
  settings.reserved = 1;
  EXPECT_REFUSED(create_with(&settings), "carom_settings.reserved");
}

static void listeners_out_of_range_are_refused(void) {
  carom_listener listeners[2];
  carom_settings settings = defaults();
  EXPECT_OK(carom_listener_init(&listeners[0], sizeof listeners[0]));
  listeners[1] = listeners[0];
  settings.listener_count = 2;
  EXPECT_REFUSED(create_with(&settings), "carom_settings.listeners is NULL");
  settings.listeners = listeners;
  EXPECT_OK(create_with(&settings));
  listeners[1].format = 4;
  EXPECT_REFUSED(create_with(&settings), "listener 1: carom_listener.format is 4");
  listeners[1] = listeners[0];
  listeners[1].position[2] = NAN;
  EXPECT(create_with(&settings) == CAROM_ERROR_ARGUMENT);
  listeners[1] = listeners[0];
  listeners[1].size -= 8;
  EXPECT_REFUSED(create_with(&settings), "listener 1");
  listeners[0].size = 0;
  EXPECT_REFUSED(create_with(&settings), "listener 0: carom_listener.size is 0");
}

static void bodies_out_of_range_are_refused(void) {
  const double corner[9] = {0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0};
  const uint32_t open[3] = {0, 1, 2};
  const uint32_t outside[3] = {0, 1, 3};
  carom_sound* const sound = make_sound(NULL, 1.0);
  carom_body body;
  EXPECT_OK(carom_body_init(&body, sizeof body));
  EXPECT_REFUSED(carom_set_body(sound, 0, &body), "material is NULL");
  body.material = "cheese";
  EXPECT_REFUSED(carom_set_body(sound, 0, &body), "cheese");
  body.material = "steel";
  EXPECT_OK(carom_set_body(sound, 0, &body));
  body.mass = NAN;
  EXPECT_REFUSED(carom_set_body(sound, 0, &body), "mass");
  body.mass = 1.0;
  EXPECT_REFUSED(carom_set_body(sound, 0, &body), "radius");
  body.radius = 0.1;
  body.edge_radius = 0.0;
  EXPECT_REFUSED(carom_set_body(sound, 0, &body), "edge radius");
  body.edge_radius = 0.001;
  body.shape = 3;
  EXPECT_REFUSED(carom_set_body(sound, 0, &body), "shape is 3");
  body.shape = CAROM_SHAPE_BOX;
  EXPECT_REFUSED(carom_set_body(sound, 0, &body), "half_extents");
  body.half_extents[0] = body.half_extents[1] = body.half_extents[2] = 0.01;
  body.inertia[0] = -1.0;
  EXPECT_REFUSED(carom_set_body(sound, 0, &body), "inertia");
  body.inertia[0] = 0.0;
  body.shape = CAROM_SHAPE_MESH;
  EXPECT_REFUSED(carom_set_body(sound, 0, &body), "vertices is NULL");
  body.vertices = corner;
  body.vertex_count = 3;
  EXPECT_REFUSED(carom_set_body(sound, 0, &body), "triangles is NULL");
  body.triangles = outside;
  body.triangle_count = 1;
  EXPECT(carom_set_body(sound, 0, &body) == CAROM_ERROR_ARGUMENT);
  body.triangles = open;
  EXPECT(carom_set_body(sound, 0, &body) == CAROM_ERROR_ARGUMENT);
  EXPECT_OK(carom_destroy(sound));
}

// A struct as a later version might define it.
typedef struct later_event {
  carom_event known;
  double more[2];
} later_event;

static void structs_of_later_versions_are_known_by_their_size(void) {
  carom_sound* const sound = make_sound(NULL, 1.0);
  later_event event;
  memset(&event, 0xFF, sizeof event);
  EXPECT_OK(carom_event_init(&event.known, sizeof event));
  EXPECT(event.known.size == sizeof event && event.more[0] == 0.0 && event.more[1] == 0.0);
  EXPECT_OK(carom_post(sound, &event.known));
  event.more[1] = 1.0;
  EXPECT_REFUSED(carom_post(sound, &event.known), "does not know");
  EXPECT_OK(carom_destroy(sound));
}

// Structs of programs that were compiled before bodies rang are shorter, and followed by any bytes.
static void structs_of_the_first_version_are_known_by_their_size(void) {
  carom_sound* const sound = make_sound(NULL, STRIKE_HEIGHT);
  carom_settings settings;
  carom_statistics statistics;
  carom_statistics untouched;
  carom_material material;
  carom_body body;
  memset(&settings, 0xFF, sizeof settings);
  EXPECT_OK(carom_settings_init(&settings, offsetof(carom_settings, ringing_bodies)));
  EXPECT(settings.voices == defaults().voices);
  EXPECT(settings.ringing_bodies == (size_t)-1 && settings.modes == (size_t)-1);
  EXPECT_OK(create_with(&settings));
  settings.reserved = 1;
  EXPECT_REFUSED(create_with(&settings), "carom_settings.reserved");

  memset(&untouched, 0xFF, sizeof untouched);
  statistics = untouched;
  statistics.size = offsetof(carom_statistics, rings);
  EXPECT_OK(carom_get_statistics(sound, &statistics));
  EXPECT(statistics.size == offsetof(carom_statistics, rings) && statistics.events == 0);
  EXPECT(memcmp(&statistics.rings, &untouched.rings,
                sizeof statistics - offsetof(carom_statistics, rings)) == 0);

  material.size = offsetof(carom_material, damping_alpha);
  material.damping_alpha = -1.0;
  material.damping_beta = NAN;
  EXPECT_OK(carom_find_material("steel", &material));
  EXPECT(material.density == 8940.0 && material.damping_alpha == -1.0);
  EXPECT_OK(carom_body_init(&body, sizeof body));
  body.own_material = &material;
  EXPECT_OK(carom_set_body(sound, BLOCK, &body));
  material.size = sizeof material;
  EXPECT_REFUSED(carom_set_body(sound, BLOCK, &body), "damping");
  EXPECT_OK(carom_destroy(sound));
}

static void structs_of_no_version_are_refused(void) {
  carom_sound* const sound = make_sound(NULL, 1.0);
  carom_event event = strike();
  carom_statistics statistics;
  carom_material material;
  event.size = 8;
  EXPECT_REFUSED(carom_post(sound, &event), "carom_event.size is 8");
  event.size = (size_t)-1;
  EXPECT_REFUSED(carom_post(sound, &event), "carom_event.size");
  memset(&statistics, 0, sizeof statistics);
  EXPECT_REFUSED(carom_get_statistics(sound, &statistics), "carom_statistics.size is 0");
  material.size = sizeof material - 1;
  EXPECT_REFUSED(carom_find_material("steel", &material), "carom_material.size");
  material.size = offsetof(carom_material, damping_beta);  // a size between those of two versions
  EXPECT_REFUSED(carom_find_material("steel", &material), "carom_material.size");
  EXPECT_REFUSED(carom_event_init(&event, 0), "carom_event.size");
  EXPECT_REFUSED(carom_body_init((carom_body*)&event, 7), "carom_body.size");
  EXPECT_OK(carom_destroy(sound));
}

// Makes all calls of a sound of events, up to one that fails for lack of memory; returns the last
// status.
static carom_status live(carom_sound** sound) {
  const carom_event event = strike();
  carom_body body;
  carom_modes* modes = NULL;
  carom_status status = carom_create(NULL, sound);
  EXPECT((status == CAROM_OK) == (*sound != NULL));
  (void)carom_body_init(&body, sizeof body);
  body.material = "steel";
  body.mass = STRIKE_MASS;
  body.radius = STRIKE_RADIUS;
  if (status == CAROM_OK) status = carom_set_body(*sound, BALL, &body);
  if (status == CAROM_OK) status = carom_set_body(*sound, BLOCK, &body);
  if (status == CAROM_OK) status = carom_load_modes(modes_path, &modes);
  if (status == CAROM_OK) status = carom_set_body_modes(*sound, BALL, modes);
  carom_free_modes(modes);
  if (status == CAROM_OK) status = carom_prepare_rendering(*sound, STRIKE_SAMPLE_RATE);
  if (status == CAROM_OK) status = carom_record(*sound, "c_api_memory.wav");
  if (status == CAROM_OK) status = carom_advance(*sound, 0.0);
  if (status == CAROM_OK) status = carom_post(*sound, &event);
  if (status == CAROM_OK) status = carom_advance(*sound, 0.2);
  return status;
}

// Whichever allocation fails, the call reports it, and the handle can be destroyed.
static void lack_of_memory_is_a_status(void) {
  carom_status status = CAROM_ERROR_MEMORY;
  long pieces = 0;
  carom_free_modes(load(1000.0, 20.0));
  while (status != CAROM_OK && pieces < 1000000) {
    carom_sound* sound = NULL;
    support_fail_after(pieces);
    status = live(&sound);
    support_fail_after(-1);
    EXPECT(status == CAROM_OK || status == CAROM_ERROR_MEMORY);
    if (status != CAROM_OK) EXPECT(strstr(carom_last_message(), "memory") != NULL);
    EXPECT(carom_destroy(sound) == CAROM_OK);
    ++pieces;
  }
  EXPECT(pieces > 100);
}

static void lack_of_memory_leaves_a_world_as_it_was(void) {
  support_world* const world = support_world_make();
  carom_status status = CAROM_ERROR_MEMORY;
  long pieces = 0;
  while (status != CAROM_OK && pieces < 1000000) {
    carom_sound* sound = NULL;
    support_fail_after(pieces);
    status = carom_attach(support_world_bullet(world), NULL, &sound);
    support_fail_after(-1);
    EXPECT(status == CAROM_OK || status == CAROM_ERROR_MEMORY);
    EXPECT((status == CAROM_OK) == (sound != NULL));
    EXPECT_OK(carom_destroy(sound));
    support_world_step(world, 0.01);
    ++pieces;
  }
  EXPECT(pieces > 10);
  support_world_free(world);
}

typedef struct claim {
  const char* name;
  void (*holds)(void);
} claim;

#define CLAIM(function) \
  { #function, function }

int main(void) {
  static const claim claims[] = {
    CLAIM(library_has_the_version_of_its_header),
    CLAIM(every_status_has_a_text_of_its_own),
    CLAIM(materials_are_found_by_index_and_by_name),
    CLAIM(steel_is_that_of_the_paper),
    CLAIM(click_begins_when_sound_has_come_from_the_ball),
    CLAIM(samples_are_those_of_synth_bit_for_bit),
    CLAIM(interleaved_samples_are_the_planar_ones),
    CLAIM(cube_sounds_as_the_sphere_that_moves_as_much_air),
    CLAIM(recording_holds_the_pascals_of_synth_over_20),
    CLAIM(destroying_completes_a_recording),
    CLAIM(file_that_cannot_be_is_refused),
    CLAIM(full_scale_divides_pascals),
    CLAIM(limiter_keeps_its_ceiling),
    CLAIM(gain_and_mute_act_on_what_is_rendered),
#if CAROM_TEST_DEVICE
    CLAIM(device_is_played_and_let_go),
#endif
    CLAIM(device_that_is_not_there_is_refused),
    CLAIM(listener_is_heard_where_it_was_put),
    CLAIM(events_are_counted_by_what_became_of_them),
    CLAIM(ball_of_a_bullet_world_is_heard_when_it_lands),
    CLAIM(materials_are_set_by_object_shape_and_user_index),
    CLAIM(modes_are_those_of_the_file),
    CLAIM(modes_that_cannot_be_read_are_refused),
    CLAIM(struck_body_rings_at_its_frequency_and_falls_at_its_rate),
    CLAIM(modes_stay_with_a_body_until_it_is_removed),
    CLAIM(modes_are_set_by_object_shape_and_user_index),
    CLAIM(modes_are_refused_for_what_is_not_there),
    CLAIM(calls_of_the_other_kind_of_sound_are_refused),
    CLAIM(null_handle_is_refused_by_every_call),
    CLAIM(null_arguments_are_refused),
    CLAIM(numbers_out_of_range_are_refused),
    CLAIM(settings_out_of_range_are_refused),
    CLAIM(listeners_out_of_range_are_refused),
    CLAIM(bodies_out_of_range_are_refused),
    CLAIM(structs_of_later_versions_are_known_by_their_size),
    CLAIM(structs_of_the_first_version_are_known_by_their_size),
    CLAIM(structs_of_no_version_are_refused),
    CLAIM(lack_of_memory_is_a_status),
    CLAIM(lack_of_memory_leaves_a_world_as_it_was),
  };
  for (size_t index = 0; index < sizeof claims / sizeof claims[0]; ++index) {
    const int before = failures;
    claims[index].holds();
    printf("%s %s\n", failures == before ? "ok    " : "FAILED", claims[index].name);
  }
  return failures == 0 ? 0 : 1;
}
