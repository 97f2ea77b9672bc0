"""Real-time techniques in moderngl. Never imports `reference`."""
