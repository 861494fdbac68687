"""`mill mesh`: foreign meshes as closed surfaces that millsim accepts."""
