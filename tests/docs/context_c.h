// Names that the fragments of C in the pages take as given; see context.h.

#pragma once

#include <stddef.h>
#include <stdio.h>

#include <carom/carom.h>

static carom_sound* sound;
static carom_body body;
static carom_settings settings;
static void* ball;
