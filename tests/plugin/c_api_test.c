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

static carom_body strike_ball(void) {
  carom_body body;
  EXPECT_OK(carom_body_init(&body, sizeof body));
  body.material = "steel";
  body.mass = STRIKE_MASS;
  body.radius = STRIKE_RADIUS;
  return body;
}

static void set_ringing_ball(carom_sound* sound, const carom_modes* modes) {
  carom_body body = strike_ball();
  body.modes = modes;
  EXPECT_OK(carom_set_body(sound, BALL, &body));
}

static void set_strike_bodies(carom_sound* sound) {
  carom_body body;
  EXPECT_OK(carom_body_init(&body, sizeof body));
  body.material = "wood";
  EXPECT_OK(carom_set_body(sound, BLOCK, &body));
  set_ringing_ball(sound, NULL);
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

// Takes FRAMES of the strike out of memory, after the latency's silence, in reads of 480.
static void capture_strike(carom_sound* sound, double latency, float* samples) {
  const carom_event event = strike();
  size_t silent = (size_t)(latency * STRIKE_SAMPLE_RATE + 0.5);
  float sample = 0.0F;
  set_strike_bodies(sound);
  EXPECT(carom_captured_frames(sound) == 0);
  EXPECT_OK(carom_capture(sound));
  EXPECT_OK(carom_post(sound, &event));
  EXPECT_OK(carom_advance(sound, 1.0));
  EXPECT(carom_captured_frames(sound) == (size_t)STRIKE_SAMPLE_RATE);
  EXPECT(carom_take_captured(sound, NULL, 480) == 0);
  for (; silent > 0; --silent)
    EXPECT(carom_take_captured(sound, &sample, 1) == 1 && sample == 0);
  for (size_t frame = 0; frame < FRAMES; frame += 480)
    EXPECT(carom_take_captured(sound, samples + frame, 480) == 480);
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

static carom_body_sound body_sound(void) {
  carom_body_sound sound;
  EXPECT_OK(carom_body_sound_init(&sound, sizeof sound));
  return sound;
}

static carom_body_sound of_material(const char* name) {
  carom_body_sound sound = body_sound();
  sound.material = name;
  return sound;
}

static carom_body_sound of_own_material(const carom_material* material) {
  carom_body_sound sound = body_sound();
  sound.own_material = material;
  return sound;
}

static carom_body_sound of_modes(const carom_modes* modes) {
  carom_body_sound sound = body_sound();
  sound.modes = modes;
  sound.no_modes = modes == NULL;
  return sound;
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

static void captured_samples_are_those_of_synth_a_latency_later(void) {
  static float samples[FRAMES];
  static float expected[FRAMES];
  carom_sound* const sound = make_sound(NULL, STRIKE_HEIGHT);
  carom_settings settings;
  EXPECT_OK(carom_settings_init(&settings, sizeof settings));
  capture_strike(sound, settings.latency, samples);
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
  int axis = 0;
  // Foam is so soft that its click is long and low: such a light tap would not be heard.
  for (axis = 0; axis < 3; ++axis)
    event.impulse[axis] *= 1000.0;
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
  carom_settings settings;
  carom_sound* sound = NULL;
  const carom_event event = strike();
  size_t count = 0;
  EXPECT_OK(carom_settings_init(&settings, sizeof settings));
  settings.level = CAROM_LEVEL_FIXED;
  sound = make_sound(&settings, STRIKE_HEIGHT);
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

static long size_of(const char* path) {
  FILE* const file = fopen(path, "rb");
  long size = -1;
  if (file == NULL) return -1;
  if (fseek(file, 0, SEEK_END) == 0) size = ftell(file);
  (void)fclose(file);
  return size;
}

static void run_is_written_and_kept(void) {
  const char* const path = "c_api_whole.carom";
  const char* const kept = "c_api_kept.carom";
  carom_sound* const sound = make_sound(NULL, STRIKE_HEIGHT);
  const carom_event event = strike();
  (void)remove(path);
  (void)remove(kept);
  set_strike_bodies(sound);
  EXPECT(carom_save_run(sound, kept) == CAROM_ERROR_FILE);
  EXPECT_REFUSED(carom_keep_run(sound, -1.0), "0 to 86400");
  EXPECT_OK(carom_keep_run(sound, 10.0));
  EXPECT_OK(carom_record_run(sound, path));
  EXPECT(carom_record_run(sound, path) == CAROM_ERROR_FILE);
  EXPECT_OK(carom_advance(sound, 0.0));
  EXPECT_OK(carom_post(sound, &event));
  EXPECT_OK(carom_advance(sound, 0.3));
  EXPECT_OK(carom_save_run(sound, kept));
  EXPECT(size_of(path) == -1);
  EXPECT_OK(carom_finish_run(sound));
  EXPECT_OK(carom_finish_run(sound));
  EXPECT(size_of(path) > 300 && size_of(kept) > 300);
  EXPECT_REFUSED(carom_record_run(sound, NULL), "NULL");
  EXPECT_REFUSED(carom_save_run(sound, NULL), "NULL");
  EXPECT_OK(carom_destroy(sound));
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

static void level_that_is_automatic_is_in_range(void) {
  static float samples[FRAMES];
  char text[200];
  carom_settings settings;
  carom_sound* sound = NULL;
  EXPECT_OK(carom_settings_init(&settings, sizeof settings));
  EXPECT(settings.level == CAROM_LEVEL_STANDARD);
  settings.level = CAROM_LEVEL_AUTOMATIC;
  sound = make_sound(&settings, STRIKE_HEIGHT);
  render_strike(sound, samples);
  EXPECT(peak_of(samples, FRAMES) > 0.126F);    /* -18 dB */
  EXPECT(peak_of(samples, FRAMES) <= 0.89126F); /* -1 dB */
  EXPECT(carom_warning(sound, text, sizeof text) == 0 && text[0] == '\0');
  EXPECT_OK(carom_destroy(sound));
}

static void peak_above_full_scale_is_warned_of(void) {
  static float samples[FRAMES];
  char text[200];
  carom_settings settings;
  carom_sound* sound = NULL;
  EXPECT_OK(carom_settings_init(&settings, sizeof settings));
  settings.full_scale = 0.001;
  sound = make_sound(&settings, STRIKE_HEIGHT);
  render_strike(sound, samples);
  EXPECT(statistics_of(sound).peak_sample == (double)peak_of(samples, FRAMES));
  EXPECT(carom_warning(sound, text, sizeof text) > 0 && strstr(text, "above full scale") != NULL);
  EXPECT(carom_recording_error(sound, text, sizeof text) == 0 && text[0] == '\0');
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
  carom_body_sound glass;
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
  glass = of_material("glass");
  EXPECT_OK(carom_assign_body(sound, support_world_ball(world), &glass));
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

static carom_status assign_to_ball(carom_sound* sound, support_world* world,
                                   carom_body_sound body_sound_to_assign) {
  return carom_assign_body(sound, support_world_ball(world), &body_sound_to_assign);
}

static void materials_are_assigned_to_bodies_shapes_and_user_indices(void) {
  support_world* const world = support_world_make();
  const btCollisionShape* const shape = support_world_shape(world);
  carom_material own = foam();
  const carom_body_sound steel = of_material("steel");
  const carom_body_sound cheese = of_material("cheese");
  carom_body_sound of_foam = of_own_material(&own);
  carom_sound* sound = NULL;
  EXPECT_OK(carom_attach(support_world_bullet(world), NULL, &sound));
  EXPECT_OK(assign_to_ball(sound, world, steel));
  EXPECT_OK(carom_assign_shape(sound, shape, &steel));
  EXPECT_OK(carom_assign_user_index(sound, 7, &steel));
  EXPECT_OK(assign_to_ball(sound, world, of_foam));
  EXPECT_OK(carom_assign_shape(sound, shape, &of_foam));
  EXPECT_OK(carom_assign_user_index(sound, 7, &of_foam));
  EXPECT_OK(carom_prepare_bodies(sound));
  EXPECT_OK(carom_unassign_body(sound, support_world_ball(world)));
  EXPECT_OK(carom_unassign_shape(sound, shape));
  EXPECT_OK(carom_unassign_user_index(sound, 7));

  EXPECT_REFUSED(assign_to_ball(sound, world, cheese), "cheese");
  EXPECT(strstr(carom_last_message(), "aluminium") != NULL);
  EXPECT_REFUSED(carom_assign_body(sound, NULL, &steel), "NULL");
  EXPECT_REFUSED(carom_assign_shape(sound, NULL, &steel), "NULL");
  EXPECT_REFUSED(carom_assign_shape(sound, shape, NULL), "carom_body_sound is NULL");
  EXPECT_REFUSED(carom_unassign_body(sound, NULL), "NULL");
  EXPECT_REFUSED(carom_unassign_shape(sound, NULL), "NULL");
  EXPECT_REFUSED(carom_assign_body(sound, support_world_absent(world), &steel), "not in the world");
  EXPECT_REFUSED(carom_unassign_body(sound, support_world_absent(world)), "not in the world");
  own.density = -1.0;
  EXPECT_REFUSED(carom_assign_user_index(sound, 7, &of_foam), "density");
  own.density = NAN;
  EXPECT_REFUSED(carom_assign_user_index(sound, 7, &of_foam), "density");
  own.size = 3;
  EXPECT_REFUSED(carom_assign_shape(sound, shape, &of_foam), "carom_material.size is 3");
  of_foam.size = 4;
  EXPECT_REFUSED(carom_assign_shape(sound, shape, &of_foam), "carom_body_sound.size is 4");
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

// Reads a whole file of at most `most` bytes; returns the number of bytes.
static size_t read_file(const char* path, unsigned char* bytes, size_t most) {
  FILE* const file = fopen(path, "rb");
  const size_t count = file == NULL ? 0 : fread(bytes, 1, most, file);
  if (file != NULL) fclose(file);
  return count;
}

static void modes_are_read_from_memory(void) {
  static unsigned char bytes[1U << 16U];
  carom_modes* modes = load(440.5, 3.25);
  const size_t count = read_file(modes_path, bytes, sizeof bytes);
  double frequency = 0.0;
  carom_free_modes(modes);
  EXPECT(count > 0 && count < sizeof bytes);
  EXPECT_OK(carom_read_modes(bytes, count, NULL, &modes));
  EXPECT_OK(carom_mode_at(modes, 0, &frequency, NULL));
  EXPECT(frequency == 440.5);
  carom_free_modes(modes);
  EXPECT_REFUSED(carom_read_modes(bytes, count - 1, "a bell", &modes), "a bell");
  EXPECT(modes == NULL);
  EXPECT_REFUSED(carom_read_modes(NULL, count, NULL, &modes), "NULL");
  EXPECT_REFUSED(carom_read_modes(bytes, count, NULL, NULL), "NULL");
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
  set_ringing_ball(sound, modes);
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

static void body_rings_as_it_was_set_last(void) {
  carom_sound* const sound = make_sound(NULL, STRIKE_HEIGHT);
  carom_modes* const modes = load(1000.0, 20.0);
  set_strike_bodies(sound);
  EXPECT_OK(carom_prepare_rendering(sound, STRIKE_SAMPLE_RATE));
  EXPECT_OK(carom_advance(sound, 0.0));
  EXPECT(rings_with_a_strike_at(sound, 0.1) == 0);
  set_ringing_ball(sound, modes);
  EXPECT(rings_with_a_strike_at(sound, 0.6) == 1);
  set_ringing_ball(sound, NULL);
  EXPECT(rings_with_a_strike_at(sound, 1.1) == 1);
  set_ringing_ball(sound, modes);
  EXPECT_OK(carom_remove_body(sound, BALL));
  EXPECT(rings_with_a_strike_at(sound, 1.6) == 1);
  EXPECT(statistics_of(sound).rejected == 1);
  carom_free_modes(modes);
  EXPECT_OK(carom_destroy(sound));
}

enum { BY_BODY = 1, BY_SHAPE = 2, BY_USER_INDEX = 4, NOT_BY_BODY = 8, UNASSIGNED_AGAIN = 16 };

// True if the ball of the Bullet world rings when it lands.
static int rings_in_bullet(int ways) {
  static float samples[24000];
  float* channel = samples;
  support_world* const world = support_world_make();
  carom_modes* const modes = load(1000.0, 20.0);
  carom_settings settings;
  carom_listener listener;
  carom_sound* sound = NULL;
  carom_body_sound rings_as;
  uint64_t rings = 0;
  EXPECT_OK(carom_listener_init(&listener, sizeof listener));
  EXPECT_OK(carom_settings_init(&settings, sizeof settings));
  listener.position[1] = 0.5;
  settings.listeners = &listener;
  settings.listener_count = 1;
  settings.clock = CAROM_CLOCK_SIMULATION;
  EXPECT_OK(carom_attach(support_world_bullet(world), &settings, &sound));
  rings_as = of_modes(modes);
  if (ways & BY_USER_INDEX) EXPECT_OK(carom_assign_user_index(sound, 7, &rings_as));
  if (ways & BY_SHAPE) EXPECT_OK(carom_assign_shape(sound, support_world_shape(world), &rings_as));
  if (ways & BY_BODY) EXPECT_OK(assign_to_ball(sound, world, rings_as));
  if (ways & NOT_BY_BODY) EXPECT_OK(assign_to_ball(sound, world, of_modes(NULL)));
  if (ways & UNASSIGNED_AGAIN) EXPECT_OK(carom_unassign_body(sound, support_world_ball(world)));
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

static void modes_are_assigned_to_bodies_shapes_and_user_indices(void) {
  EXPECT(!rings_in_bullet(0));
  EXPECT(rings_in_bullet(BY_BODY));
  EXPECT(rings_in_bullet(BY_SHAPE));
  EXPECT(rings_in_bullet(BY_USER_INDEX));
  EXPECT(!rings_in_bullet(BY_SHAPE | BY_USER_INDEX | NOT_BY_BODY));
  EXPECT(rings_in_bullet(BY_SHAPE | NOT_BY_BODY | UNASSIGNED_AGAIN));
}

static void parts_that_contradict_each_other_are_refused(void) {
  support_world* const world = support_world_make();
  carom_modes* const modes = load(1000.0, 20.0);
  carom_body_sound sound_of_body = of_modes(modes);
  carom_sound* sound = NULL;
  EXPECT_OK(carom_attach(support_world_bullet(world), NULL, &sound));
  sound_of_body.no_modes = 1;
  EXPECT_REFUSED(assign_to_ball(sound, world, sound_of_body), "carom_body_sound.no_modes is 1");
  sound_of_body.no_modes = 0;
  sound_of_body.silent = 3;
  EXPECT_REFUSED(assign_to_ball(sound, world, sound_of_body), "carom_body_sound.silent is 3");
  carom_free_modes(modes);
  EXPECT_OK(carom_destroy(sound));
  support_world_free(world);
}

// A silent ball is not heard, nor the floor that it hits; CAROM_NO takes that back for one body.
static void silent_bodies_are_not_heard(void) {
  for (int heard = 0; heard < 2; ++heard) {
    static float samples[24000];
    float* channels[2] = {samples, samples + 12000};
    support_world* const world = support_world_make();
    carom_body_sound silence = body_sound();
    carom_settings settings;
    carom_sound* sound = NULL;
    EXPECT_OK(carom_settings_init(&settings, sizeof settings));
    settings.clock = CAROM_CLOCK_SIMULATION;
    EXPECT_OK(carom_attach(support_world_bullet(world), &settings, &sound));
    silence.silent = CAROM_YES;
    EXPECT_OK(carom_assign_shape(sound, support_world_shape(world), &silence));
    silence.silent = CAROM_NO;
    if (heard) EXPECT_OK(assign_to_ball(sound, world, silence));
    EXPECT_OK(carom_prepare_rendering(sound, STRIKE_SAMPLE_RATE));
    support_world_step(world, 0.4);
    EXPECT_OK(carom_render(sound, channels, 2, 12000));
    EXPECT((peak_of(samples, 24000) > 0.0F) == heard);
    EXPECT(statistics_of(sound).events == (heard ? 1U : 0U));
    EXPECT(statistics_of(sound).silenced == (heard ? 0U : 2U));
    EXPECT_OK(carom_destroy(sound));
    support_world_free(world);
  }
}

static void calls_of_the_other_kind_of_sound_are_refused(void) {
  support_world* const world = support_world_make();
  const btCollisionObject* const ball = support_world_ball(world);
  const carom_event event = strike();
  const carom_body_sound steel = of_material("steel");
  carom_contact contact;
  carom_sound* of_world = NULL;
  carom_sound* const of_events = make_sound(NULL, 1.0);
  carom_body body;
  EXPECT_OK(carom_body_init(&body, sizeof body));
  EXPECT_OK(carom_attach(support_world_bullet(world), NULL, &of_world));
  EXPECT(carom_post(of_world, &event) == CAROM_ERROR_KIND);
  EXPECT_OK(carom_contact_init(&contact, sizeof contact));
  EXPECT(carom_update_contact(of_world, &contact) == CAROM_ERROR_KIND);
  EXPECT(carom_advance(of_world, 1.0) == CAROM_ERROR_KIND);
  EXPECT(carom_move_body(of_world, 0, 0.0, event.position, NULL) == CAROM_ERROR_KIND);
  EXPECT(carom_set_body(of_world, 0, &body) == CAROM_ERROR_KIND);
  EXPECT(carom_remove_body(of_world, 0) == CAROM_ERROR_KIND);
  EXPECT(strstr(carom_last_message(), "carom_create") != NULL);
  EXPECT(carom_assign_body(of_events, ball, &steel) == CAROM_ERROR_KIND);
  EXPECT(carom_assign_shape(of_events, support_world_shape(world), &steel) == CAROM_ERROR_KIND);
  EXPECT(carom_assign_user_index(of_events, 0, &steel) == CAROM_ERROR_KIND);
  EXPECT(carom_unassign_user_index(of_events, 0) == CAROM_ERROR_KIND);
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
  EXPECT_REFUSED(carom_update_contact(NULL, NULL), "carom_sound is NULL");
  EXPECT_REFUSED(carom_move_body(NULL, 0, 0.0, place, NULL), "carom_sound is NULL");
  EXPECT_REFUSED(carom_assign_body(NULL, NULL, NULL), "carom_sound is NULL");
  EXPECT_REFUSED(carom_assign_shape(NULL, NULL, NULL), "carom_sound is NULL");
  EXPECT_REFUSED(carom_assign_user_index(NULL, 0, NULL), "carom_sound is NULL");
  EXPECT_REFUSED(carom_unassign_body(NULL, NULL), "carom_sound is NULL");
  EXPECT_REFUSED(carom_unassign_shape(NULL, NULL), "carom_sound is NULL");
  EXPECT_REFUSED(carom_unassign_user_index(NULL, 0), "carom_sound is NULL");
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
  EXPECT_REFUSED(carom_capture(NULL), "carom_sound is NULL");
  EXPECT(carom_captured_frames(NULL) == 0 && carom_take_captured(NULL, channel, 1) == 0);
  EXPECT(carom_unsolved_reason(NULL, NULL, 0) == 0);
  EXPECT(carom_warning(NULL, NULL, 0) == 0);
  EXPECT(carom_recording_error(NULL, NULL, 0) == 0);
}

static void null_arguments_are_refused(void) {
  const double place[3] = {0.0, 0.0, 0.0};
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
  EXPECT_REFUSED(carom_body_sound_init(NULL, sizeof(carom_body_sound)), "carom_body_sound is NULL");
  EXPECT_REFUSED(carom_contact_init(NULL, sizeof(carom_contact)), "carom_contact is NULL");
  EXPECT_REFUSED(carom_room_init(NULL, sizeof(carom_room)), "carom_room is NULL");
  EXPECT_REFUSED(carom_reflector_init(NULL, sizeof(carom_reflector)), "carom_reflector is NULL");
  EXPECT_REFUSED(carom_reverb_init(NULL, sizeof(carom_reverb)), "carom_reverb is NULL");
  EXPECT_REFUSED(carom_roughness_init(NULL, sizeof(carom_roughness)), "carom_roughness is NULL");
  EXPECT_REFUSED(carom_normal_map_init(NULL, sizeof(carom_normal_map)), "carom_normal_map is NULL");
  EXPECT_REFUSED(carom_surface_at(0, NULL), "carom_surface is NULL");
  EXPECT_REFUSED(carom_find_surface(NULL, NULL), "NULL");
  EXPECT_REFUSED(carom_default_surface(NULL, NULL), "NULL");
  EXPECT_REFUSED(carom_reverb_of_box(NULL, 343.0, NULL), "carom_room is NULL");
  EXPECT_REFUSED(carom_update_contact(sound, NULL), "carom_contact is NULL");
  EXPECT_REFUSED(carom_material_at(0, NULL), "carom_material is NULL");
  EXPECT_REFUSED(carom_find_material("steel", NULL), "carom_material is NULL");
  EXPECT_REFUSED(carom_find_material(NULL, &steel), "NULL");
  EXPECT_REFUSED(carom_set_body(sound, 0, NULL), "carom_body is NULL");
  EXPECT_REFUSED(carom_post(sound, NULL), "carom_event is NULL");
  EXPECT_REFUSED(carom_move_body(sound, 0, 0.0, NULL, NULL), "position of the body is NULL");
  EXPECT_REFUSED(carom_move_body(sound, 77, 0.0, place, NULL), "no body 77");
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
  settings = defaults();
  settings.pulse = 5;
  EXPECT_REFUSED(create_with(&settings), "carom_settings.pulse is 5; expected 0 to 4");
  settings = defaults();
  settings.sampling = -1;
  EXPECT_REFUSED(create_with(&settings), "carom_settings.sampling");
  settings = defaults();
  settings.radiation = 2;
  EXPECT_REFUSED(create_with(&settings), "carom_settings.radiation");
  settings = defaults();
  settings.modal_radiation = 3;
  EXPECT_REFUSED(create_with(&settings), "carom_settings.modal_radiation");
  settings = defaults();
  settings.dissipative = 2;
  EXPECT_REFUSED(create_with(&settings), "carom_settings.dissipative");
  settings = defaults();
  settings.sliding_contacts = 4097;
  EXPECT_REFUSED(create_with(&settings), "sliding contacts");
  settings = defaults();
  settings.contact_loss = NAN;
  EXPECT(create_with(&settings) == CAROM_ERROR_ARGUMENT);
  settings = defaults();
  settings.limiter = 1;
  settings.limiter_release = NAN;
  EXPECT(create_with(&settings) == CAROM_ERROR_ARGUMENT);
}

enum { WALLS = 6 };

// The six walls of a box of 4 x 3 x 5 m around the origin, of a built-in surface.
static void make_box(carom_reflector walls[WALLS], const char* surface) {
  const double sizes[3] = {4.0, 3.0, 5.0};
  for (int wall = 0; wall < WALLS; ++wall) {
    const int axis = wall / 2;
    EXPECT_OK(carom_reflector_init(&walls[wall], sizeof walls[wall]));
    walls[wall].normal[2] = 0.0;
    walls[wall].normal[axis] = wall % 2 == 0 ? 1.0 : -1.0;
    walls[wall].offset = -0.5 * sizes[axis];
    walls[wall].surface = surface;
  }
}

static carom_room room_of(const carom_reflector* walls, size_t count) {
  carom_room room;
  EXPECT_OK(carom_room_init(&room, sizeof room));
  room.reflectors = walls;
  room.reflector_count = count;
  return room;
}

// A rigid wall behind the ball sends back an image: twice the way from wall to ball later, and as
// the ball's dipole points to the microphone, of the opposite sign.
static void wall_reflects_the_strike(void) {
  static float open[FRAMES];
  static float walled[FRAMES];
  const double to_wall = 2.0;
  const double later = 2.0 * to_wall / 343.0 * STRIKE_SAMPLE_RATE;
  carom_settings settings = defaults();
  carom_reflector wall;
  carom_room room = room_of(&wall, 1);
  size_t direct = 0;
  size_t reflected = 0;
  carom_sound* sound = make_sound(NULL, STRIKE_HEIGHT);
  render_strike(sound, open);
  EXPECT_OK(carom_destroy(sound));
  EXPECT_OK(carom_reflector_init(&wall, sizeof wall));
  wall.normal[2] = 0.0;
  wall.normal[1] = 1.0;
  wall.offset = -to_wall;
  wall.surface = "rigid";
  settings.room = &room;
  sound = make_sound(&settings, STRIKE_HEIGHT);
  render_strike(sound, walled);
  EXPECT_OK(carom_destroy(sound));
  direct = first_above(open, FRAMES, 0.5F * peak_of(open, FRAMES));
  for (size_t frame = 0; frame < FRAMES; ++frame)
    walled[frame] -= open[frame];
  EXPECT(peak_of(walled, direct + 400) < 1e-6F * peak_of(open, FRAMES));
  reflected = first_above(walled, FRAMES, 0.5F * peak_of(walled, FRAMES));
  EXPECT(fabs((double)reflected - (double)direct - later) < 3.0);
  EXPECT(open[direct] * walled[reflected] < 0.0F);
}

static void rooms_out_of_range_are_refused(void) {
  carom_reflector walls[WALLS];
  carom_room room = room_of(walls, WALLS);
  carom_settings settings = defaults();
  make_box(walls, "concrete");
  settings.room = &room;
  room.order = 3;
  EXPECT_OK(create_with(&settings));
  room.order = 33;
  EXPECT(create_with(&settings) == CAROM_ERROR_ARGUMENT);
  room.order = 1;
  room.reserved = 1;
  EXPECT_REFUSED(create_with(&settings), "carom_room.reserved");
  room.reserved = 0;
  walls[2].surface = "cheese";
  EXPECT_REFUSED(create_with(&settings), "reflector 2: there is no surface 'cheese'");
  walls[2].surface = NULL;
  EXPECT_OK(create_with(&settings));
  walls[2].absorption[3] = 1.5;
  EXPECT(create_with(&settings) == CAROM_ERROR_ARGUMENT);
  walls[2].absorption[3] = NAN;
  EXPECT(create_with(&settings) == CAROM_ERROR_ARGUMENT);
  walls[2].absorption[3] = 0.0;
  walls[1].size -= 8;
  EXPECT_REFUSED(create_with(&settings), "reflector 1: its size");
  room.reflectors = NULL;
  EXPECT_REFUSED(create_with(&settings), "carom_room.reflectors is NULL");
  room.size = 1;
  EXPECT_REFUSED(create_with(&settings), "carom_room.size is 1");
}

static void surfaces_are_found_by_index_name_and_material(void) {
  EXPECT(carom_surface_count() >= 8);
  for (size_t index = 0; index < carom_surface_count(); ++index) {
    carom_surface by_index;
    carom_surface by_name;
    by_index.size = sizeof by_index;
    by_name.size = sizeof by_name;
    EXPECT_OK(carom_surface_at(index, &by_index));
    EXPECT_OK(carom_find_surface(by_index.name, &by_name));
    EXPECT(by_name.absorption[0] == by_index.absorption[0] && strlen(by_index.source) > 0);
  }
  {
    carom_surface surface;
    surface.size = sizeof surface;
    EXPECT_OK(carom_default_surface("steel", &surface));
    EXPECT(strcmp(surface.name, "marble") == 0);
    EXPECT_REFUSED(carom_default_surface("cheese", &surface), "cheese");
    EXPECT_REFUSED(carom_find_surface("cheese", &surface), "there is no surface 'cheese'");
    EXPECT_REFUSED(carom_surface_at(carom_surface_count(), &surface), "there is no surface");
  }
}

// Eyring: T60 = 24 ln(10) V / (c S (-ln(1 - alpha))), with V = 60 m^3 and S = 94 m^2.
static void reverberation_of_a_box_is_eyrings(void) {
  carom_reflector walls[WALLS];
  carom_room room = room_of(walls, WALLS);
  carom_reverb reverb;
  carom_settings settings = defaults();
  make_box(walls, NULL);
  for (int wall = 0; wall < WALLS; ++wall)
    for (int band = 0; band < CAROM_BAND_COUNT; ++band)
      walls[wall].absorption[band] = 0.25;
  reverb.size = sizeof reverb;
  EXPECT_OK(carom_reverb_of_box(&room, 343.0, &reverb));
  EXPECT(fabs(reverb.volume - 60.0) < 1e-9 && fabs(reverb.surface - 94.0) < 1e-9);
  EXPECT(fabs(reverb.decay_times[2] - 24.0 * log(10.0) * 60.0 / (343.0 * 94.0 * -log(1.0 - 0.25))) <
         1e-9);
  EXPECT(reverb.includes_air == 0);
  settings.air_humidity = 50.0;
  EXPECT_REFUSED(create_with(&settings), "relative humidity");
  settings.air_humidity = 0.5;
  settings.air_absorption = 2;
  EXPECT_REFUSED(create_with(&settings), "carom_settings.air_absorption");
  settings.air_absorption = 1;
  settings.room = &room;
  settings.reverb = &reverb;
  EXPECT_OK(create_with(&settings));
  reverb.includes_air = 2;
  EXPECT_REFUSED(create_with(&settings), "carom_reverb.includes_air");
  reverb.includes_air = 1;
  reverb.gain = NAN;
  EXPECT(create_with(&settings) == CAROM_ERROR_ARGUMENT);
  room.reflector_count = 5;
  EXPECT(carom_reverb_of_box(&room, 343.0, &reverb) == CAROM_ERROR_ARGUMENT);
}

static void head_that_cannot_be_read_is_refused(void) {
  carom_listener ears;
  carom_settings settings = defaults();
  EXPECT_OK(carom_listener_init(&ears, sizeof ears));
  settings.listeners = &ears;
  settings.listener_count = 1;
  ears.sofa_file = "no/such/head.sofa";
  EXPECT_REFUSED(create_with(&settings), "CAROM_LISTENER_BINAURAL");
  ears.format = CAROM_LISTENER_BINAURAL;
  EXPECT_REFUSED(create_with(&settings), "carom_listener.sofa_file");
}

// The eight corners of a cube are directions that surround a listener. In this head, the ear that
// is turned towards a source hears it twice as loud.
enum { CORNERS = 8, HEAD_SAMPLES = 4 };
static carom_head_responses cube_head(double* directions, float* samples) {
  carom_head_responses responses = {sizeof responses, 48000.0,     NULL, NULL, NULL,
                                    CORNERS,          HEAD_SAMPLES};
  size_t corner = 0;
  memset(samples, 0, 2 * CORNERS * HEAD_SAMPLES * sizeof *samples);
  for (corner = 0; corner < CORNERS; ++corner) {
    const int is_right = (corner & 1U) != 0;
    directions[3 * corner] = is_right ? 1.0 : -1.0;
    directions[3 * corner + 1] = (corner & 2U) != 0 ? 1.0 : -1.0;
    directions[3 * corner + 2] = (corner & 4U) != 0 ? 1.0 : -1.0;
    samples[2 * corner * HEAD_SAMPLES + 1] = is_right ? 0.5F : 1.0F;
    samples[(2 * corner + 1) * HEAD_SAMPLES + 1] = is_right ? 1.0F : 0.5F;
  }
  responses.directions = directions;
  responses.samples = samples;
  return responses;
}

static void head_of_responses_turns_the_nearer_ear_louder(void) {
  static float block[2 * FRAMES];
  double directions[3 * CORNERS];
  float samples[2 * CORNERS * HEAD_SAMPLES];
  const carom_head_responses responses = cube_head(directions, samples);
  carom_head* head = NULL;
  carom_listener ears;
  carom_settings settings = defaults();
  carom_sound* sound = NULL;
  carom_event event = strike();
  float left = 0.0F;
  float right = 0.0F;
  size_t frame = 0;
  EXPECT_OK(carom_make_head(&responses, 48000.0, &head));
  EXPECT_OK(carom_listener_init(&ears, sizeof ears));
  ears.head = head;
  settings.listeners = &ears;
  settings.listener_count = 1;
  EXPECT_REFUSED(create_with(&settings), "CAROM_LISTENER_BINAURAL");
  ears.format = CAROM_LISTENER_BINAURAL;
  ears.sofa_file = "head.sofa";
  EXPECT_REFUSED(create_with(&settings), "both head and sofa_file");
  ears.sofa_file = NULL;
  settings.sample_rate = 48000.0;
  settings.clock = CAROM_CLOCK_SIMULATION;
  EXPECT_OK(carom_create(&settings, &sound));
  carom_free_head(head);
  carom_free_head(NULL);
  set_strike_bodies(sound);
  event.position[0] = event.body_position[0] = 1.0;
  event.position[1] = event.body_position[1] = -1.0;
  EXPECT_OK(carom_prepare_rendering(sound, 48000.0));
  EXPECT_OK(carom_post(sound, &event));
  EXPECT_OK(carom_advance(sound, 0.2));
  EXPECT_OK(carom_render_interleaved(sound, block, 2, FRAMES));
  for (frame = 0; frame < FRAMES; ++frame) {
    left = fmaxf(left, fabsf(block[2 * frame]));
    right = fmaxf(right, fabsf(block[2 * frame + 1]));
  }
  EXPECT(left > 0.0F && right > 1.5F * left && right < 2.5F * left);
  EXPECT_OK(carom_destroy(sound));
}

static void head_of_responses_that_are_wrong_is_refused(void) {
  double directions[3 * CORNERS];
  float samples[2 * CORNERS * HEAD_SAMPLES];
  carom_head_responses responses = cube_head(directions, samples);
  carom_head* head = NULL;
  EXPECT_REFUSED(carom_make_head(NULL, 48000.0, &head), "carom_head_responses is NULL");
  EXPECT_REFUSED(carom_make_head(&responses, 48000.0, NULL), "NULL");
  EXPECT_REFUSED(carom_make_head(&responses, 0.0, &head), "sample rate is 0");
  EXPECT(head == NULL);
  responses.direction_count = (size_t)-1;
  EXPECT_REFUSED(carom_make_head(&responses, 48000.0, &head), "directions of 4 samples");
  responses.direction_count = 3;
  EXPECT_REFUSED(carom_make_head(&responses, 48000.0, &head), "3 directions");
  responses.direction_count = CORNERS;
  responses.samples = NULL;
  EXPECT_REFUSED(carom_make_head(&responses, 48000.0, &head), "NULL");
}

// A body of some modes that slides over a floor of these bumps, at 0.5 m/s under 1 N for 0.4 s;
// returns the statistics.
static carom_statistics slide_over(const carom_body* floor_body, size_t contacts) {
  static float samples[2 * FRAMES];
  carom_settings settings = defaults();
  carom_body block = strike_ball();
  carom_contact contact;
  carom_statistics counted;
  carom_sound* sound = NULL;
  settings.sliding_contacts = contacts;
  sound = make_sound(&settings, STRIKE_HEIGHT);
  EXPECT_OK(carom_contact_init(&contact, sizeof contact));
  EXPECT_OK(carom_set_body(sound, BLOCK, floor_body));
  EXPECT_OK(carom_set_body(sound, BALL, &block));
  EXPECT_OK(carom_prepare_rendering(sound, STRIKE_SAMPLE_RATE));
  EXPECT_OK(carom_advance(sound, 0.0));
  contact.body = BALL;
  contact.other = BLOCK;
  contact.normal[0] = 0.0;
  contact.normal[1] = 1.0;
  contact.radius = STRIKE_RADIUS;
  contact.normal_load = 1.0;
  contact.duration = 0.01;
  contact.slip_velocity[0] = 0.5;
  contact.rolling_velocity[0] = 0.25;
  contact.body_velocity[0] = 0.5;
  contact.path_start[1] = contact.path_end[1] = -STRIKE_RADIUS;
  for (int step = 0; step < 40; ++step) {
    contact.phase = step == 0 ? CAROM_CONTACT_BEGIN : CAROM_CONTACT_DURING;
    contact.time = 0.01 * step;
    contact.position[0] = contact.other_path_start[0] = 0.005 * step;
    contact.body_position[0] = 0.005 * step;
    contact.body_position[1] = STRIKE_RADIUS;
    contact.other_path_end[0] = 0.005 * (step + 1);
    contact.applied_impulse[1] = 0.01;
    EXPECT_OK(carom_update_contact(sound, &contact));
    EXPECT_OK(carom_advance(sound, 0.01 * (step + 1)));
  }
  pull(sound, samples);
  counted = statistics_of(sound);
  EXPECT((peak_of(samples, FRAMES) > 0.0F) == (counted.slides > 0 && contacts > 0));
  contact.path_start[0] = NAN;
  EXPECT_OK(carom_update_contact(sound, &contact));  // ignored
  contact.phase = 3;
  EXPECT_REFUSED(carom_update_contact(sound, &contact), "carom_contact.phase is 3");
  contact.size = 7;
  EXPECT_REFUSED(carom_update_contact(sound, &contact), "carom_contact.size is 7");
  EXPECT_OK(carom_destroy(sound));
  return counted;
}

static carom_material smooth_steel(carom_roughness* smooth) {
  carom_material material;
  material.size = sizeof material;
  EXPECT_OK(carom_find_material("steel", &material));
  EXPECT(material.roughness != NULL && material.roughness->rms_height > 0.0);
  EXPECT_OK(carom_roughness_init(smooth, sizeof *smooth));
  smooth->rms_height = 0.0;
  material.roughness = smooth;
  return material;
}

static void body_that_slides_over_bumps_is_heard(void) {
  carom_body floor_body;
  carom_roughness bumps;
  carom_texture* texture = NULL;
  EXPECT_OK(carom_body_init(&floor_body, sizeof floor_body));
  floor_body.material = "wood";
  EXPECT(slide_over(&floor_body, 32).slides > 0);
  EXPECT(slide_over(&floor_body, 0).slides_left_out > 0);
  EXPECT_OK(carom_roughness_init(&bumps, sizeof bumps));
  bumps.rms_height = 2e-5;
  bumps.correlation_length = 1e-3;
  EXPECT_OK(carom_make_rough_texture(&bumps, 1, &texture));
  floor_body.texture = texture;
  EXPECT(slide_over(&floor_body, 32).slides > 0);
  carom_free_texture(texture);
}

static void roughness_is_that_of_the_material(void) {
  carom_roughness smooth;
  const carom_material material = smooth_steel(&smooth);
  carom_sound* const sound = make_sound(NULL, 1.0);
  carom_body body = strike_ball();
  body.own_material = &material;
  EXPECT_OK(carom_set_body(sound, BALL, &body));
  smooth.hurst = NAN;
  EXPECT_REFUSED(carom_set_body(sound, BALL, &body), "urst");
  smooth.size = 5;
  EXPECT_REFUSED(carom_set_body(sound, BALL, &body), "carom_roughness.size is 5");
  EXPECT_OK(carom_destroy(sound));
}

static void textures_out_of_range_are_refused(void) {
  const double texel[2] = {1e-4, 1e-4};
  const float slopes[8] = {0.1F, 0.0F, -0.1F, 0.0F, 0.1F, 0.0F, -0.1F, 0.0F};
  const char* const no_picture = "this is no PNG";
  carom_roughness bumps;
  carom_normal_map map;
  carom_texture* texture = (carom_texture*)&bumps;
  EXPECT_OK(carom_roughness_init(&bumps, sizeof bumps));
  EXPECT_OK(carom_normal_map_init(&map, sizeof map));
  EXPECT_REFUSED(carom_make_rough_texture(&bumps, 1, NULL), "carom_texture** is NULL");
  EXPECT_REFUSED(carom_make_rough_texture(NULL, 1, &texture), "carom_roughness is NULL");
  EXPECT(texture == NULL);
  bumps.rms_height = NAN;
  EXPECT(carom_make_rough_texture(&bumps, 1, &texture) == CAROM_ERROR_ARGUMENT);
  EXPECT_OK(carom_make_texture(2, 2, texel, slopes, &texture));
  carom_free_texture(texture);
  EXPECT(carom_make_texture(3, 2, texel, slopes, &texture) == CAROM_ERROR_ARGUMENT);
  EXPECT_REFUSED(carom_make_texture(1 << 20, 1 << 20, texel, slopes, &texture), "8192");
  EXPECT_REFUSED(carom_make_texture(2, 2, NULL, slopes, &texture), "NULL");
  EXPECT_REFUSED(carom_make_texture(2, 2, texel, NULL, &texture), "NULL");
  EXPECT(carom_load_normal_map("no/such/map.png", NULL, &texture) == CAROM_ERROR_FILE);
  EXPECT(strstr(carom_last_message(), "no/such/map.png") != NULL);
  EXPECT_REFUSED(carom_load_normal_map(NULL, NULL, &texture), "NULL");
  EXPECT(carom_read_normal_map(no_picture, strlen(no_picture), "map", NULL, &texture) ==
         CAROM_ERROR_ARGUMENT);
  EXPECT_REFUSED(carom_read_normal_map(NULL, 0, "map", NULL, &texture), "NULL");
  map.green_is_down = 2;
  EXPECT_REFUSED(carom_load_normal_map("no/such/map.png", &map, &texture),
                 "carom_normal_map.green_is_down is 2");
  carom_free_texture(NULL);
}

// A square of side 2 m that shows the whole picture once.
static void texture_coordinates_have_the_size_of_their_picture(void) {
  const double vertices[12] = {0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 2.0, 2.0, 0.0, 0.0, 2.0, 0.0};
  const uint32_t triangles[6] = {0, 1, 2, 0, 2, 3};
  const double corners[12] = {0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 1.0};
  carom_mesh mesh = {sizeof mesh, vertices, 4, triangles, 2};
  carom_texture_coordinates* coordinates = NULL;
  double size[2] = {0.0, 0.0};
  EXPECT_OK(carom_make_texture_coordinates(&mesh, corners, &coordinates));
  EXPECT_OK(carom_texture_coordinates_size(coordinates, size));
  EXPECT(fabs(size[0] - 2.0) < 1e-9 && fabs(size[1] - 2.0) < 1e-9);
  EXPECT_REFUSED(carom_texture_coordinates_size(coordinates, NULL), "NULL");
  EXPECT_REFUSED(carom_texture_coordinates_size(NULL, size), "NULL");
  carom_free_texture_coordinates(coordinates);
  carom_free_texture_coordinates(NULL);
  EXPECT_REFUSED(carom_make_texture_coordinates(NULL, corners, &coordinates), "carom_mesh is NULL");
  EXPECT_REFUSED(carom_make_texture_coordinates(&mesh, NULL, &coordinates), "NULL");
  EXPECT_REFUSED(carom_make_texture_coordinates(&mesh, corners, NULL), "NULL");
  mesh.vertex_count = 3;
  EXPECT(carom_make_texture_coordinates(&mesh, corners, &coordinates) == CAROM_ERROR_ARGUMENT);
  EXPECT(coordinates == NULL);
  mesh.vertices = NULL;
  EXPECT_REFUSED(carom_make_texture_coordinates(&mesh, corners, &coordinates), "vertices is NULL");
}

static void listeners_out_of_range_are_refused(void) {
  carom_listener listeners[2];
  carom_settings settings = defaults();
  EXPECT_OK(carom_listener_init(&listeners[0], sizeof listeners[0]));
  listeners[1] = listeners[0];
  settings.listener_count = 2;
  settings.level = 3;
  EXPECT_REFUSED(create_with(&settings), "carom_settings.level is 3");
  settings.level = CAROM_LEVEL_STANDARD;
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
  material.size = offsetof(carom_material, roughness);
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
  if (status == CAROM_OK) status = carom_set_body(*sound, BLOCK, &body);
  if (status == CAROM_OK) status = carom_load_modes(modes_path, &modes);
  body.modes = modes;
  if (status == CAROM_OK) status = carom_set_body(*sound, BALL, &body);
  carom_free_modes(modes);
  if (status == CAROM_OK) status = carom_prepare_rendering(*sound, STRIKE_SAMPLE_RATE);
  if (status == CAROM_OK) status = carom_record(*sound, "c_api_memory.wav");
  if (status == CAROM_OK) status = carom_advance(*sound, 0.0);
  if (status == CAROM_OK) status = carom_post(*sound, &event);
  if (status == CAROM_OK) status = carom_advance(*sound, 0.2);
  return status;
}

// Allocations from one that fails to the next: all fail in turn, but where each run takes ten times
// as long.
#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define FAILURE_STRIDE 5
#endif
#endif
#ifndef FAILURE_STRIDE
#define FAILURE_STRIDE 1
#endif

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
    pieces += FAILURE_STRIDE;
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
    CLAIM(captured_samples_are_those_of_synth_a_latency_later),
    CLAIM(interleaved_samples_are_the_planar_ones),
    CLAIM(cube_sounds_as_the_sphere_that_moves_as_much_air),
    CLAIM(recording_holds_the_pascals_of_synth_over_20),
    CLAIM(destroying_completes_a_recording),
    CLAIM(run_is_written_and_kept),
    CLAIM(file_that_cannot_be_is_refused),
    CLAIM(full_scale_divides_pascals),
    CLAIM(level_that_is_automatic_is_in_range),
    CLAIM(peak_above_full_scale_is_warned_of),
    CLAIM(limiter_keeps_its_ceiling),
    CLAIM(gain_and_mute_act_on_what_is_rendered),
#if CAROM_TEST_DEVICE
    CLAIM(device_is_played_and_let_go),
#endif
    CLAIM(device_that_is_not_there_is_refused),
    CLAIM(listener_is_heard_where_it_was_put),
    CLAIM(events_are_counted_by_what_became_of_them),
    CLAIM(ball_of_a_bullet_world_is_heard_when_it_lands),
    CLAIM(materials_are_assigned_to_bodies_shapes_and_user_indices),
    CLAIM(modes_are_those_of_the_file),
    CLAIM(modes_are_read_from_memory),
    CLAIM(modes_that_cannot_be_read_are_refused),
    CLAIM(struck_body_rings_at_its_frequency_and_falls_at_its_rate),
    CLAIM(body_rings_as_it_was_set_last),
    CLAIM(modes_are_assigned_to_bodies_shapes_and_user_indices),
    CLAIM(parts_that_contradict_each_other_are_refused),
    CLAIM(silent_bodies_are_not_heard),
    CLAIM(calls_of_the_other_kind_of_sound_are_refused),
    CLAIM(null_handle_is_refused_by_every_call),
    CLAIM(null_arguments_are_refused),
    CLAIM(numbers_out_of_range_are_refused),
    CLAIM(settings_out_of_range_are_refused),
    CLAIM(wall_reflects_the_strike),
    CLAIM(rooms_out_of_range_are_refused),
    CLAIM(surfaces_are_found_by_index_name_and_material),
    CLAIM(reverberation_of_a_box_is_eyrings),
    CLAIM(head_that_cannot_be_read_is_refused),
    CLAIM(head_of_responses_turns_the_nearer_ear_louder),
    CLAIM(head_of_responses_that_are_wrong_is_refused),
    CLAIM(body_that_slides_over_bumps_is_heard),
    CLAIM(roughness_is_that_of_the_material),
    CLAIM(textures_out_of_range_are_refused),
    CLAIM(texture_coordinates_have_the_size_of_their_picture),
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
