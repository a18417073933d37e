!> Settings of the root of the beam (its end x = 0), &root, and of point masses fixed to the beam, &mass. E Ibar is the
!> bending stiffness, rho Abar L the mass of the uniform beam of mean section with length L.
module root_and_mass_settings
   use kinds, only: wp
   use run_settings, only: name_length
   implicit none (type, external)
   private
   public :: root_settings_t, mass_settings_t
   public :: root_clamped, root_pinned, root_names

   !> The root is clamped; a given spring replaces the clamping against displacement or rotation.
   integer, parameter :: root_clamped = 1
   !> The root is pinned: it rotates freely and has no displacement.
   integer, parameter :: root_pinned = 2
   !> Names of the `root_` constants in scene files
   character(*), parameter :: root_names(2) = [character(name_length) :: 'clamped', 'pinned']

   !> Settings of &root.
   type :: root_settings_t
      !> One of the `root_` constants
      integer :: kind = root_clamped
      !> Stiffness k / (3 E Ibar / L) of a spring against rotation; 0: there is no spring, and the root is rigidly fixed
      !> against rotation
      real(wp) :: rotation_stiffness_ratio = 0.0_wp
      !> Stiffness k / (3 E Ibar / L^3) of a spring against displacement; 0: there is no spring, and the root is rigidly
      !> fixed against displacement
      real(wp) :: translation_stiffness_ratio = 0.0_wp
   end type root_settings_t

   !> Settings of a &mass.
   type :: mass_settings_t
      !> x / L of the mass
      real(wp) :: position = 1.0_wp
      !> Mass m / (rho Abar L)
      real(wp) :: mass_ratio = 0.0_wp
      !> Rotary inertia J / (rho Abar L^3)
      real(wp) :: rotary_inertia_ratio = 0.0_wp
   end type mass_settings_t

end module root_and_mass_settings
