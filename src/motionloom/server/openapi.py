DOCUMENT = {"openapi": "3.1.0"}


def as_page(document):
    return "<!doctype html><title>motionloom</title>"
