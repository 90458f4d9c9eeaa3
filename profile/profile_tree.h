/* Words of the reference profile tree (docs/profiles.md, profile-layer.md 1) [PROFILE 4.2.2, 4.6.1].
 *
 * A profile is four components of four bits from the root of the tree, most significant first. The root tells
 * set points from sensor signals; below it even components belong to this tree, odd ones to vendors
 * (D-PRO-22). The lower word has priority. */
#ifndef PROFILE_TREE_H
#define PROFILE_TREE_H

/* What actuators shall do. */
enum {
    PROFILE_SET_POINT = 0x1000,               /* Set point */
    PROFILE_GRIP = 0x1200,                    /* Grip */
    PROFILE_GRIP_POWER = 0x1220,              /* Power grip */
    PROFILE_GRIP_PINCH = 0x1240,              /* Pinch grip */
    PROFILE_GRIP_LATERAL = 0x1260,            /* Lateral grip */
    PROFILE_GRIP_TRIPOD = 0x1280,             /* Tripod grip */
    PROFILE_GRIP_HOOK = 0x12A0,               /* Hook grip */
    PROFILE_GRIP_POINT = 0x12C0,              /* Point */
    PROFILE_GRIP_FORCE = 0x12E0,              /* Grip force set point */
    PROFILE_ELBOW = 0x1400,                   /* Elbow */
    PROFILE_WRIST = 0x1600,                   /* Wrist */
    PROFILE_WRIST_ROTATION = 0x1620,          /* Wrist rotation */
    PROFILE_WRIST_FLEXION = 0x1640,           /* Wrist flexion */
    PROFILE_WRIST_DEVIATION = 0x1660,         /* Wrist deviation */
    PROFILE_FINGER = 0x1800,                  /* Finger */
    PROFILE_FINGER_THUMB = 0x1820,            /* Thumb */
    PROFILE_FINGER_THUMB_FLEXION = 0x1822,    /* Thumb flexion */
    PROFILE_FINGER_THUMB_OPPOSITION = 0x1824, /* Thumb opposition */
    PROFILE_FINGER_INDEX = 0x1840,            /* Index finger */
    PROFILE_FINGER_MIDDLE = 0x1860,           /* Middle finger */
    PROFILE_FINGER_RING = 0x1880,             /* Ring finger */
    PROFILE_FINGER_LITTLE = 0x18A0,           /* Little finger */
    PROFILE_FEEDBACK = 0x1E00,                /* Feedback */
    PROFILE_FEEDBACK_VIBRATION = 0x1E20,      /* Vibration */
    PROFILE_FEEDBACK_STIMULATION = 0x1E40,    /* Electrode stimulation */
    PROFILE_FEEDBACK_PRESSURE = 0x1E60        /* Pressure feedback */
};

/* What sensors measure. */
enum {
    PROFILE_SENSOR = 0x2000,                    /* Sensor signal */
    PROFILE_EMG = 0x2200,                       /* EMG */
    PROFILE_EMG_AMPLITUDE = 0x2220,             /* EMG amplitude */
    PROFILE_EMG_AMPLITUDE_FLEXOR = 0x2222,      /* EMG amplitude, forearm flexors */
    PROFILE_EMG_AMPLITUDE_EXTENSOR = 0x2224,    /* EMG amplitude, forearm extensors */
    PROFILE_EMG_AMPLITUDE_BICEPS = 0x2226,      /* EMG amplitude, biceps */
    PROFILE_EMG_AMPLITUDE_TRICEPS = 0x2228,     /* EMG amplitude, triceps */
    PROFILE_EMG_AMPLITUDE_DELTOID = 0x222A,     /* EMG amplitude, deltoid */
    PROFILE_EMG_AMPLITUDE_PECTORAL = 0x222C,    /* EMG amplitude, pectoral muscle */
    PROFILE_EMG_AMPLITUDE_TRAPEZIUS = 0x222E,   /* EMG amplitude, trapezius */
    PROFILE_EMG_RAW = 0x2240,                   /* Raw EMG */
    PROFILE_EMG_RAW_FLEXOR = 0x2242,            /* Raw EMG, forearm flexors */
    PROFILE_EMG_RAW_EXTENSOR = 0x2244,          /* Raw EMG, forearm extensors */
    PROFILE_EMG_RAW_BICEPS = 0x2246,            /* Raw EMG, biceps */
    PROFILE_EMG_RAW_TRICEPS = 0x2248,           /* Raw EMG, triceps */
    PROFILE_EMG_RAW_DELTOID = 0x224A,           /* Raw EMG, deltoid */
    PROFILE_EMG_RAW_PECTORAL = 0x224C,          /* Raw EMG, pectoral muscle */
    PROFILE_EMG_RAW_TRAPEZIUS = 0x224E,         /* Raw EMG, trapezius */
    PROFILE_EMG_SWITCH = 0x2260,                /* EMG switch */
    PROFILE_EMG_SWITCH_FLEXOR = 0x2262,         /* EMG switch, forearm flexors */
    PROFILE_EMG_SWITCH_EXTENSOR = 0x2264,       /* EMG switch, forearm extensors */
    PROFILE_EMG_SWITCH_BICEPS = 0x2266,         /* EMG switch, biceps */
    PROFILE_EMG_SWITCH_TRICEPS = 0x2268,        /* EMG switch, triceps */
    PROFILE_EMG_SWITCH_DELTOID = 0x226A,        /* EMG switch, deltoid */
    PROFILE_EMG_SWITCH_PECTORAL = 0x226C,       /* EMG switch, pectoral muscle */
    PROFILE_EMG_SWITCH_TRAPEZIUS = 0x226E,      /* EMG switch, trapezius */
    PROFILE_ENCODER = 0x2400,                   /* Encoder */
    PROFILE_ENCODER_GRIP = 0x2420,              /* Grip encoder */
    PROFILE_ENCODER_ELBOW = 0x2440,             /* Elbow encoder */
    PROFILE_ENCODER_WRIST = 0x2460,             /* Wrist encoder */
    PROFILE_ENCODER_WRIST_ROTATION = 0x2462,    /* Wrist rotation encoder */
    PROFILE_ENCODER_WRIST_FLEXION = 0x2464,     /* Wrist flexion encoder */
    PROFILE_ENCODER_WRIST_DEVIATION = 0x2466,   /* Wrist deviation encoder */
    PROFILE_ENCODER_FINGER = 0x2480,            /* Finger encoder */
    PROFILE_ENCODER_FINGER_THUMB = 0x2482,      /* Thumb encoder */
    PROFILE_ENCODER_FINGER_INDEX = 0x2484,      /* Index finger encoder */
    PROFILE_ENCODER_FINGER_MIDDLE = 0x2486,     /* Middle finger encoder */
    PROFILE_ENCODER_FINGER_RING = 0x2488,       /* Ring finger encoder */
    PROFILE_ENCODER_FINGER_LITTLE = 0x248A,     /* Little finger encoder */
    PROFILE_ENCODER_FINGER_OPPOSITION = 0x248C, /* Thumb opposition encoder */
    PROFILE_IMU = 0x2600,                       /* Motion */
    PROFILE_IMU_ACCELERATION = 0x2620,          /* Acceleration */
    PROFILE_IMU_ACCELERATION_X = 0x2622,        /* Acceleration, x */
    PROFILE_IMU_ACCELERATION_Y = 0x2624,        /* Acceleration, y */
    PROFILE_IMU_ACCELERATION_Z = 0x2626,        /* Acceleration, z */
    PROFILE_IMU_RATE = 0x2640,                  /* Angular rate */
    PROFILE_IMU_RATE_X = 0x2642,                /* Angular rate, x */
    PROFILE_IMU_RATE_Y = 0x2644,                /* Angular rate, y */
    PROFILE_IMU_RATE_Z = 0x2646,                /* Angular rate, z */
    PROFILE_IMU_ORIENTATION = 0x2660,           /* Orientation */
    PROFILE_IMU_ORIENTATION_ROLL = 0x2662,      /* Roll */
    PROFILE_IMU_ORIENTATION_PITCH = 0x2664,     /* Pitch */
    PROFILE_IMU_ORIENTATION_YAW = 0x2666,       /* Yaw */
    PROFILE_FORCE = 0x2800,                     /* Force and pressure */
    PROFILE_FORCE_TOUCH = 0x2820,               /* Touch */
    PROFILE_FORCE_TOUCH_THUMB = 0x2822,         /* Touch, thumb */
    PROFILE_FORCE_TOUCH_INDEX = 0x2824,         /* Touch, index finger */
    PROFILE_FORCE_TOUCH_MIDDLE = 0x2826,        /* Touch, middle finger */
    PROFILE_FORCE_TOUCH_RING = 0x2828,          /* Touch, ring finger */
    PROFILE_FORCE_TOUCH_LITTLE = 0x282A,        /* Touch, little finger */
    PROFILE_FORCE_TOUCH_PALM = 0x282C,          /* Touch, palm */
    PROFILE_FORCE_GRIP = 0x2840,                /* Grip force */
    PROFILE_FORCE_TORQUE = 0x2860,              /* Torque */
    PROFILE_FORCE_SOCKET = 0x2880,              /* Socket pressure */
    PROFILE_CONTROL = 0x2A00,                   /* Control element */
    PROFILE_CONTROL_BUTTON = 0x2A20,            /* Button */
    PROFILE_CONTROL_SWITCH = 0x2A40,            /* Switch */
    PROFILE_CONTROL_JOYSTICK = 0x2A60,          /* Joystick */
    PROFILE_CONTROL_JOYSTICK_X = 0x2A62,        /* Joystick, x */
    PROFILE_CONTROL_JOYSTICK_Y = 0x2A64,        /* Joystick, y */
    PROFILE_CONTROL_JOYSTICK_TWIST = 0x2A66,    /* Joystick, twist */
    PROFILE_CONTROL_SLIDER = 0x2A80,            /* Slider */
    PROFILE_TEMPERATURE = 0x2C00,               /* Temperature */
    PROFILE_TEMPERATURE_DRIVE = 0x2C20,         /* Drive temperature */
    PROFILE_TEMPERATURE_SKIN = 0x2C40,          /* Skin temperature */
    PROFILE_TEMPERATURE_BATTERY = 0x2C60,       /* Battery temperature */
    PROFILE_SUPPLY = 0x2E00,                    /* Supply */
    PROFILE_SUPPLY_CHARGE = 0x2E20,             /* Battery charge */
    PROFILE_SUPPLY_VOLTAGE = 0x2E40,            /* Supply voltage */
    PROFILE_SUPPLY_CURRENT = 0x2E60             /* Supply current */
};

#endif
