!> Bodies as modes: a body with mass m, spring k and damper c to the base is one oscillator beside the modes of the
!> beam, coupled to them by contacts alone. Its coordinate counts from where its spring has no force.
module body_modes
   use free_modes, only: free_modes_t, rigid_square
   use kinds, only: lambda1, lambda1_power4, wp
   use run_settings, only: body_settings_t
   implicit none (type, external)
   private
   public :: append_bodies, square_of, rate_of

contains

   !> Retain some of the modes of the beam, and append one mode for each body, with a degree of freedom of its own.
   pure subroutine append_bodies(bodies, retained, modes)
      type(body_settings_t), intent(in) :: bodies(:)
      !> Number of modes of the beam that are retained, from the first
      integer, intent(in) :: retained
      type(free_modes_t), intent(inout) :: modes

      real(wp), allocatable :: shape(:, :), square(:)
      integer :: b

      associate (dofs => size(modes%mode, 1), number => size(bodies))
         allocate (shape(dofs + number, retained + number), square(retained + number), source=0.0_wp)
         shape(:dofs, :retained) = modes%mode(:, :retained)
         square(:retained) = modes%square(:retained)
         do b = 1, number
            shape(dofs + b, retained + b) = 1.0_wp/sqrt(bodies(b)%mass_ratio)
            ! a body without a spring has the tiny frequency of a rigid-body motion
            square(retained + b) = max(square_of(bodies(b)), real(b + 1, wp)*rigid_square)
            ! constraints between modes of exactly equal frequency have no solution in closed form
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

   !> Squared circular frequency k/m of a body, over omega1^2.
   elemental function square_of(body) result(square)
      type(body_settings_t), intent(in) :: body
      real(wp) :: square

      square = 3.0_wp*body%spring_ratio/(lambda1_power4*body%mass_ratio)
   end function square_of

   !> Rate c/m of the damper of a body, over omega1.
   elemental function rate_of(body) result(rate)
      type(body_settings_t), intent(in) :: body
      real(wp) :: rate

      rate = 2.0_wp*body%damping_ratio*sqrt(square_of(body)) + 3.0_wp*body%base_damper_ratio &
         /(lambda1_power4*body%mass_ratio)
   end function rate_of

end module body_modes
