!> Bodies as modes: a body of mass m, with a spring k and a damper c between it and the base, is an oscillator m z'' + c
!> z' + k z = 0 beside the modes of the beam. Contacts alone couple the body to the beam. The coordinate z of the body
!> is zero where its spring has no force.
module body_modes
   use free_modes, only: free_modes_t, rigid_square
   use kinds, only: lambda1, lambda1_power4, wp
   use run_settings, only: body_settings_t, run_settings_t
   implicit none (type, external)
   private
   public :: append_bodies, count_bodies, has_free_body, squared_frequency_of, damping_rate_of

contains

   !> Retain the first modes of the beam, and append one mode for each body, with a degree of freedom of its own. The
   !> body's displacement per unit of its mode is 1/sqrt(m), because modes are mass-normalised.
   pure subroutine append_bodies(bodies, retained, modes)
      type(body_settings_t), intent(in) :: bodies(:)
      !> Number of modes of the beam that are retained
      integer, intent(in) :: retained
      !> On entry modes of the beam; on return the retained modes, then those of the bodies
      type(free_modes_t), intent(inout) :: modes

      real(wp), allocatable :: shape(:, :), square(:)
      integer :: b

      associate (dofs => size(modes%mode, 1), number => size(bodies))
         allocate (shape(dofs + number, retained + number), square(retained + number), source=0.0_wp)
         shape(:dofs, :retained) = modes%mode(:, :retained)
         square(:retained) = modes%square(:retained)
         do b = 1, number
            shape(dofs + b, retained + b) = 1.0_wp/sqrt(bodies(b)%mass_ratio)
            ! A body without a spring gets a negligible positive W^2, because formulas divide by W^2; the factor b + 1
            ! separates it from a rigid-body mode of the beam (factor 1) and from the other bodies
            square(retained + b) = max(squared_frequency_of(bodies(b)), real(b + 1, wp)*rigid_square)
            ! `constrain` needs distinct frequencies
            do while (any(abs(square(:retained + b - 1) - square(retained + b)) <= 0.0_wp))
               square(retained + b) = nearest(square(retained + b), 1.0_wp)
            end do
         end do
         modes%lambda = lambda1*sqrt(sqrt(square))
         modes%body = [spread(0, 1, retained), [(b, b=1, number)]]
      end associate
      call move_alloc(shape, modes%mode)
      call move_alloc(square, modes%square)
   end subroutine append_bodies

   !> Number of bodies of a run.
   pure integer function count_bodies(settings) result(number)
      type(run_settings_t), intent(in) :: settings

      number = 0
      if (allocated(settings%bodies)) number = size(settings%bodies)
   end function count_bodies

   !> Whether a body has no spring.
   pure logical function has_free_body(settings) result(has)
      type(run_settings_t), intent(in) :: settings

      has = .false.
      if (allocated(settings%bodies)) has = any(settings%bodies%spring_ratio <= 0.0_wp)
   end function has_free_body

   !> Squared circular frequency k/m of a body, over omega1^2. The ratios of k and m are in 3 E Ibar/L^3 and rho Abar L,
   !> and omega1^2 = lambda1^4 E Ibar/(rho Abar L^4).
   elemental real(wp) function squared_frequency_of(body) result(square)
      type(body_settings_t), intent(in) :: body

      square = 3.0_wp*body%spring_ratio/(lambda1_power4*body%mass_ratio)
   end function squared_frequency_of

   !> Damping rate of a body over omega1: 2 xi W of its damping ratio xi, plus c/m of its damper.
   elemental real(wp) function damping_rate_of(body) result(rate)
      type(body_settings_t), intent(in) :: body

      rate = 2.0_wp*body%damping_ratio*sqrt(squared_frequency_of(body)) + 3.0_wp*body%base_damper_ratio &
         /(lambda1_power4*body%mass_ratio)
   end function damping_rate_of

end module body_modes
